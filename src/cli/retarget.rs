//! stub until the poses branch lands
use std::{path::PathBuf, process::ExitCode};
/// Arguments of `retargetd retarget`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    #[arg(long)]
    source: PathBuf,
    #[arg(long)]
    target: PathBuf,
    #[arg(long)]
    config: Option<PathBuf>,
    #[arg(long)]
    output: PathBuf,
    #[arg(long)]
    report: Option<PathBuf>,
    #[arg(long)]
    source_rest: Option<PathBuf>,
    #[arg(long)]
    target_rest: Option<PathBuf>,
}
pub(super) fn run(a: &Arguments) -> ExitCode {
    use crate::engine::*;
    let read = |p: &PathBuf| (p.file_name().unwrap().to_str().unwrap().to_owned(), std::fs::read(p).unwrap());
    let (s, t, c) = (read(&a.source), read(&a.target), a.config.as_ref().map(read));
    let (sr, tr) = (a.source_rest.as_ref().map(read), a.target_rest.as_ref().map(read));
    fn nb(x: &(String, Vec<u8>)) -> NamedBytes<'_> {
        NamedBytes { name: &x.0, bytes: &x.1 }
    }
    fn secs() -> f64 {
        use std::sync::OnceLock;
        static T: OnceLock<std::time::Instant> = OnceLock::new();
        T.get_or_init(std::time::Instant::now).elapsed().as_secs_f64()
    }
    let f = crate::formats::Format::from_file_name(a.output.to_str().unwrap()).unwrap();
    let r = retarget(
        &Inputs {
            source: nb(&s),
            target: nb(&t),
            source_rest: sr.as_ref().map(nb),
            target_rest: tr.as_ref().map(nb),
            config: c.as_ref().map(nb),
            formats: &[f],
        },
        &crate::formats::Limits::default(),
        &crate::model::Control::with_clock(secs),
    );
    match r {
        Ok(o) => {
            std::fs::write(&a.output, &o.outputs[0].bytes).unwrap();
            eprintln!("{}", serde_json::to_string_pretty(&o.report).unwrap());
            if let Some(p) = &a.report {
                std::fs::write(
                    p,
                    serde_json::to_string_pretty(&serde_json::json!({"report": o.report, "spec": o.resolved_spec}))
                        .unwrap(),
                )
                .unwrap();
            }
            ExitCode::SUCCESS
        }
        Err(e) => {
            eprintln!("{e:?}");
            super::exit::exit_code(&e)
        }
    }
}
