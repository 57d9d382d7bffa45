//! `design`: the server of the page, without a browser.
//!
//! | file | what it tests |
//! |---|---|
//! | `guests` | who is served, and what |
//! | `same` | images, figures and commands of the page are those of the command line |
//! | `tabs` | tabs, files, searches and reports |
//! | `hostile` | what no page would send |
//! | `speed` | the time from a drag to its images, by hand |

mod guests;
mod hostile;
mod same;
mod speed;
mod tabs;

use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;
use tungstenite::handshake::client::generate_key;
use tungstenite::http::Request;
use tungstenite::{Message, WebSocket};

/// The longest that a test waits for an answer.
const PATIENCE: Duration = Duration::from_secs(120);

/// The running program, with a folder of its own for temporary files.
struct Designer {
    child: Child,
    port: u16,
    token: String,
    folder: TempDir,
}

fn program() -> Command {
    Command::new(assert_cmd::cargo::cargo_bin("cittert"))
}

impl Designer {
    fn start(words: &[&str]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut command = program();
        command.args(["-q", "design", "--no-open"]).args(words).env("TMPDIR", folder.path()).stdout(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut line).unwrap();
        // http://127.0.0.1:PORT/TOKEN/
        let (port, token) = line.trim().strip_prefix("http://127.0.0.1:").unwrap().split_once('/').unwrap();
        let (port, token) = (port.parse().unwrap(), token.strip_suffix('/').unwrap().to_owned());
        Self { child, port, token, folder }
    }

    fn host(&self) -> String {
        format!("127.0.0.1:{}", self.port)
    }

    /// The status line and headers, and the body, of a request with these headers.
    fn get(&self, path: &str, headers: &[(&str, &str)]) -> (String, String) {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let lines: String = headers.iter().map(|(name, value)| format!("{name}: {value}\r\n")).collect();
        write!(stream, "GET {path} HTTP/1.1\r\n{lines}Connection: close\r\n\r\n").unwrap();
        let mut bytes = Vec::new();
        stream.read_to_end(&mut bytes).unwrap();
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let (head, body) = text.split_once("\r\n\r\n").unwrap();
        (head.to_owned(), body.to_owned())
    }

    /// A socket as a browser opens it, or why it was refused.
    fn socket(&self, token: &str, host: &str, origin: &str) -> Result<WebSocket<TcpStream>, String> {
        let stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let mut request = Request::builder().uri(format!("ws://{}/{token}/socket", self.host())).header("Host", host);
        for (name, value) in [("Origin", origin), ("Connection", "Upgrade"), ("Upgrade", "websocket"), ("Sec-WebSocket-Version", "13")] {
            request = request.header(name, value);
        }
        let request = request.header("Sec-WebSocket-Key", generate_key()).body(()).unwrap();
        tungstenite::client(request, stream).map(|(socket, _)| socket).map_err(|e| e.to_string())
    }

    fn tab(&self) -> Tab {
        let socket = self.socket(&self.token, &self.host(), &format!("http://{}", self.host())).unwrap();
        let mut tab = Tab { socket, seq: 0 };
        assert_eq!(tab.answer().header["is"], "hello");
        tab
    }

    /// End the program by a signal, and wait for it.
    fn end(&mut self, signal: &str) -> ExitStatus {
        assert!(Command::new("kill").args([signal, &self.child.id().to_string()]).status().unwrap().success());
        let began = Instant::now();
        loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                return status;
            }
            assert!(began.elapsed() < PATIENCE, "the program goes on");
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// Memory of the program, kB.
    fn memory_kb(&self) -> u64 {
        let text = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).unwrap();
        let line = text.lines().find_map(|l| l.strip_prefix("VmRSS:")).unwrap();
        line.trim().trim_end_matches(" kB").parse().unwrap()
    }
}

impl Drop for Designer {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// One answer: its object, and its numbers where it has any.
struct Answer {
    header: Value,
    numbers: Vec<f32>,
}

/// One tab.
struct Tab {
    socket: WebSocket<TcpStream>,
    seq: u64,
}

/// All answers to a state by their name.
type Shown = BTreeMap<String, Answer>;

impl Tab {
    fn send(&mut self, message: Message) {
        self.socket.send(message).unwrap();
    }

    fn tell(&mut self, message: &Value) {
        self.send(Message::text(message.to_string()));
    }

    fn answer(&mut self) -> Answer {
        loop {
            match self.socket.read().unwrap() {
                Message::Text(text) => return Answer { header: serde_json::from_str(&text).unwrap(), numbers: Vec::new() },
                Message::Binary(bytes) => {
                    let (length, rest) = bytes.split_at(4);
                    let (header, numbers) = rest.split_at(u32::from_le_bytes(length.try_into().unwrap()) as usize);
                    let numbers = numbers.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
                    return Answer { header: serde_json::from_slice(header).unwrap(), numbers };
                }
                _ => {}
            }
        }
    }

    /// The next answer of this kind, or an error.
    fn until(&mut self, is: &str) -> Value {
        loop {
            let header = self.answer().header;
            if header["is"] == is || header["is"] == "error" {
                return header;
            }
        }
    }

    /// Ask, and return the next answer of this kind, or the error.
    fn ask(&mut self, message: &Value, is: &str) -> Value {
        self.tell(message);
        self.until(is)
    }

    /// Send a state and collect what it gives.
    fn show(&mut self, state: &Value, moving: bool) -> Shown {
        self.seq += 1;
        let seq = self.seq;
        self.tell(&json!({ "do": "show", "seq": seq, "moving": moving, "state": state }));
        let mut shown = Shown::new();
        loop {
            let answer = self.answer();
            if answer.header["seq"] != seq {
                continue;
            }
            let is = answer.header["is"].as_str().unwrap().to_owned();
            let name = if is == "image" { answer.header["name"].as_str().unwrap().to_owned() } else { is.clone() };
            shown.insert(name, answer);
            if is == "done" || is == "error" {
                return shown;
            }
        }
    }

    /// The text of the error that a state gives.
    fn refused(&mut self, state: &Value) -> String {
        let shown = self.show(state, false);
        shown.get("error").map(|e| e.header["text"].as_str().unwrap().to_owned()).unwrap_or_default()
    }

    /// Drop a file.
    fn drop_file(&mut self, header: &Value, bytes: &[u8]) {
        let header = header.to_string();
        let length = (header.len() as u32).to_le_bytes();
        self.send(Message::binary([&length, header.as_bytes(), bytes].concat()));
    }
}

/// A ring of antennas, as the page holds it.
fn ring(antennas: usize, radius_m: f64) -> Value {
    let antenna = |k: usize| {
        let turn = std::f64::consts::TAU * (k as f64).powf(1.1) / antennas as f64;
        json!({ "name": format!("A{k}"), "position_m": [radius_m * turn.cos(), radius_m * turn.sin(), 0.0] })
    };
    json!({ "name": "ring", "frame": "boresight", "antenna": (0..antennas).map(antenna).collect::<Vec<_>>() })
}

/// A state of the airport.
fn airport(antennas: usize, size: usize) -> Value {
    json!({
        "layout": ring(antennas, 0.25), "seed": 3,
        "scene": { "file": "airport.toml", "scene-size": size },
        "simulate": { "freq": "94GHz", "bandwidth": "2GHz", "channels": 2 },
        "image": { "size": size },
    })
}

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect()
}
