//! A caller of one-shots who costs little: one connection, a request that is put together once, and no more of HTTP than its answer needs.
//! What is measured with it is the service.

use std::{
    io::{BufRead as _, BufReader, Read as _, Write as _},
    net::TcpStream,
    time::{Duration, Instant},
};

/// One who asks again and again for the same.
pub(super) struct Caller {
    stream: BufReader<TcpStream>,
    request: Vec<u8>,
    file: Vec<u8>,
}

impl Caller {
    /// One who sends these files: the part's name, the file's name, its bytes.
    pub(super) fn of(service: &str, parts: [(&str, &str, &[u8]); 2]) -> Self {
        let address = service.trim_start_matches("http://");
        let mut body = Vec::new();
        for (name, file_name, bytes) in parts {
            let head =
                format!("--parts\r\ncontent-disposition: form-data; name=\"{name}\"; filename=\"{file_name}\"\r\n\r\n");
            body.extend([head.as_bytes(), bytes, b"\r\n"].concat());
        }
        body.extend(b"--parts--\r\n");
        let head = format!(
            "POST /v1/retarget HTTP/1.1\r\nhost: {address}\r\ncontent-type: multipart/form-data; boundary=parts\r\n\
             content-length: {}\r\n\r\n",
            body.len()
        );
        let stream = TcpStream::connect(address).expect("connects");
        stream.set_nodelay(true).expect("is a socket");
        Self { stream: BufReader::new(stream), request: [head.into_bytes(), body].concat(), file: Vec::new() }
    }

    /// Asks for one file and waits for it. Gives how long that took, and how long the engine by itself.
    pub(super) fn ask(&mut self) -> (Duration, Duration) {
        let began = Instant::now();
        self.stream.get_mut().write_all(&self.request).expect("sends");
        let status = self.line();
        assert!(status.starts_with("HTTP/1.1 200 "), "the file: {status}");
        let (mut length, mut engine) = (0, None);
        loop {
            let line = self.line();
            let Some((name, value)) = line.split_once(':') else { break };
            match name {
                "content-length" => length = value.trim().parse().expect("a number"),
                "server-timing" => engine = engine_of(value),
                _ => {}
            }
        }
        self.file.resize(length, 0);
        self.stream.read_exact(&mut self.file).expect("all of it");
        let took = began.elapsed();
        assert!(self.file.starts_with(b"glTF"), "a GLB");
        (took, engine.expect("the engine's total"))
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        self.stream.read_line(&mut line).expect("a line");
        line.trim_end().to_owned()
    }
}

fn engine_of(timing: &str) -> Option<Duration> {
    let total = timing.split("total;dur=").nth(1)?.split(',').next()?;
    Some(Duration::from_secs_f64(total.trim().parse::<f64>().ok()? / 1e3))
}
