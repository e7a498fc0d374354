//! `POST /v1/drawing-annotations`, on the binary with the real engine.

use std::io::{Cursor, Read as _};

use reqwest::{
    Client, Response, StatusCode,
    multipart::{Form, Part},
};
use serde_json::Value;

use super::support::{PATIENCE, ServiceProcess, header, start_service};
use crate::annotations::{small_animal, small_figure};

struct Asking<'a> {
    server: &'a ServiceProcess,
    client: Client,
}

impl Asking<'_> {
    async fn post(&self, accept: &str, form: Form) -> Response {
        let request = self.client.post(format!("{}/v1/drawing-annotations", self.server.url));
        request.header("accept", accept).multipart(form).send().await.expect("an answer")
    }
}

fn picture(bytes: Vec<u8>) -> Part {
    Part::bytes(bytes).file_name("drawing.png")
}

#[tokio::test(flavor = "multi_thread")]
async fn pictures_are_annotated_over_http() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &["--max-picture-bytes", "100KiB"]);
    let asking =
        Asking { server: &server, client: Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client") };
    let figure = small_figure();

    let answer = asking.post("application/json", Form::new().part("image", picture(figure.clone()))).await;
    assert_eq!((answer.status(), header(&answer, "content-type")), (StatusCode::OK, "application/json"));
    let view: Value = answer.json().await.expect("JSON");
    assert_eq!((&view["rig"], view["skeleton"].as_array().map(Vec::len)), (&"humanoid".into(), Some(16)), "{view}");
    assert!(view["skeleton"][3]["confidence"].as_f64().is_some_and(|sure| sure > 0.5), "{view}");
    assert!(view["box"]["right"].as_u64() > view["box"]["left"].as_u64() && view["warnings"].is_array(), "{view}");

    let answer = asking.post("", Form::new().part("image", picture(figure.clone())).text("rig", "humanoid")).await;
    assert_eq!((answer.status(), header(&answer, "content-type")), (StatusCode::OK, "application/zip"));
    let archive = answer.bytes().await.expect("a body");
    let mut archive = zip::ZipArchive::new(Cursor::new(archive)).expect("an archive");
    let mut config = String::new();
    archive.by_name("char_cfg.yaml").expect("the config").read_to_string(&mut config).expect("text");
    assert!(config.contains("name: left_hand") && archive.len() == 5, "{config}");

    let refusals = [
        (Form::new().part("mask", picture(figure.clone())), 422, "missing_part"),
        (Form::new().part("image", picture(figure.clone())).text("rigs", "x"), 422, "unknown_part"),
        (Form::new().part("image", picture(figure.clone())).text("rig", "horse"), 422, "invalid_value"),
        (Form::new().part("image", picture(small_animal())).text("rig", "humanoid"), 422, "figure_not_found"),
        (Form::new().part("image", picture(b"no picture".to_vec())), 422, "asset_malformed"),
        (Form::new().part("image", picture(vec![0; 200 << 10])), 413, "body_too_large"),
    ];
    for (form, status, code) in refusals {
        let answer = asking.post("application/json", form).await;
        assert_eq!(answer.status().as_u16(), status, "{code}");
        let problem: Value = answer.json().await.expect("JSON");
        assert_eq!(problem["code"], code, "{problem}");
    }
    let answer = asking.post("image/png", Form::new().part("image", picture(figure))).await;
    assert_eq!(answer.status(), StatusCode::NOT_ACCEPTABLE);
}
