//! `view`: who is answered, what is refused, and how it ends. What the page shows is tested in a browser (`cargo xtask
//! viewer --test`).

use crate::Room;
use serde_json::Value;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::process::{Child, ChildStdout, Stdio};
use std::time::Duration;

/// A server that ends with the test.
struct Served {
    child: Child,
    out: BufReader<ChildStdout>,
    port: u16,
    token: String,
}

impl Served {
    fn start(room: &Room, elements: &str) -> Served {
        let call = ["view", "--json", "--no-open", "--elements", elements, "--rays", "8"];
        let mut child = room.command(call).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut out = BufReader::new(child.stdout.take().unwrap());
        let url = loop {
            let mut line = String::new();
            assert!(out.read_line(&mut line).unwrap() > 0, "it ended");
            let event: Value = serde_json::from_str(&line).unwrap();
            if event["event"] == "listening" {
                break event["url"].as_str().unwrap().to_owned();
            }
        };
        let rest = url.strip_prefix("http://127.0.0.1:").unwrap();
        let (port, token) = rest.split_once('/').unwrap();
        Served { port: port.parse().unwrap(), token: token.trim_end_matches('/').to_owned(), child, out }
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        stream
    }

    /// The head of the answer to a request with these headers.
    fn ask(&self, request: &str, headers: &[(&str, &str)]) -> String {
        let mut stream = self.connect();
        let headers: String = headers.iter().map(|(name, value)| format!("{name}: {value}\r\n")).collect();
        write!(stream, "{request} HTTP/1.1\r\n{headers}Connection: close\r\n\r\n").unwrap();
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).unwrap();
        String::from_utf8_lossy(&answer).split("\r\n\r\n").next().unwrap().to_owned()
    }

    fn status(&self, request: &str, headers: &[(&str, &str)]) -> u16 {
        self.ask(request, headers).split(' ').nth(1).and_then(|code| code.parse().ok()).unwrap()
    }

    fn host(&self) -> String {
        format!("127.0.0.1:{}", self.port)
    }

    fn socket(&self) -> Socket {
        let mut stream = self.connect();
        let (host, token) = (self.host(), &self.token);
        write!(
            stream,
            "GET /{token}/socket HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
             Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
        )
        .unwrap();
        let mut head = Vec::new();
        while !head.ends_with(b"\r\n\r\n") {
            let mut byte = [0];
            stream.read_exact(&mut byte).unwrap();
            head.push(byte[0]);
        }
        assert!(head.starts_with(b"HTTP/1.1 101"), "{}", String::from_utf8_lossy(&head));
        Socket(stream)
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The little of RFC 6455 that a test needs; the mask is zero.
struct Socket(TcpStream);

impl Socket {
    fn say(&mut self, text: &str) {
        let length = text.len();
        let mut frame = vec![0x81];
        match length {
            0..126 => frame.push(0x80 | length as u8),
            126..65536 => {
                frame.push(0x80 | 126);
                frame.extend((length as u16).to_be_bytes());
            }
            _ => {
                frame.push(0x80 | 127);
                frame.extend((length as u64).to_be_bytes());
            }
        }
        frame.extend([0; 4]);
        frame.extend(text.as_bytes());
        // One that is too long may be refused before it is whole.
        let _ = self.0.write_all(&frame);
    }

    /// The next message; nothing at the end.
    fn hear(&mut self) -> Option<Vec<u8>> {
        let mut head = [0; 2];
        self.0.read_exact(&mut head).ok()?;
        let length = match head[1] {
            126 => {
                let mut bytes = [0; 2];
                self.0.read_exact(&mut bytes).ok()?;
                u16::from_be_bytes(bytes) as usize
            }
            127 => {
                let mut bytes = [0; 8];
                self.0.read_exact(&mut bytes).ok()?;
                u64::from_be_bytes(bytes) as usize
            }
            length => length as usize,
        };
        let mut body = vec![0; length];
        self.0.read_exact(&mut body).ok()?;
        let is_close = head[0] & 0xf == 8;
        (!is_close).then_some(body)
    }

    /// The next message of a kind.
    fn hear_of(&mut self, kind: &str) -> Value {
        loop {
            let message = self.hear().unwrap_or_else(|| panic!("no {kind} came"));
            match serde_json::from_slice::<Value>(&message) {
                Ok(value) if value["kind"] == kind => return value,
                _ => {}
            }
        }
    }
}

#[test]
fn only_who_has_the_token_and_the_right_name_is_answered() {
    let room = Room::new("view-guard");
    let served = Served::start(&room, "200");
    let (host, token) = (served.host(), served.token.clone());
    let page = format!("GET /{token}/");
    let own = ("Host", host.as_str());
    let head = served.ask(&page, &[own]).to_lowercase();
    assert!(head.starts_with("http/1.1 200"), "{head}");
    assert!(head.contains("content-security-policy: default-src 'none'"), "{head}");
    assert_eq!(served.status("GET /", &[own]), 403);
    assert_eq!(served.status(&format!("GET /{}/", "0".repeat(32)), &[own]), 403);
    assert_eq!(served.status(&page, &[("Host", "evil.example")]), 421);
    assert_eq!(served.status(&page, &[("Host", &format!("evil.example:{}", served.port))]), 421);
    assert_eq!(served.status(&page, &[own, ("Origin", "http://evil.example")]), 403);
    assert_eq!(served.status(&format!("POST /{token}/"), &[own]), 405);
    assert_eq!(served.status(&format!("GET /{token}/texture/0.png"), &[own]), 404);
    assert_eq!(served.status(&format!("GET /{token}/texture/..%2f..%2fCargo.toml"), &[own]), 404);
    assert_eq!(served.status(&format!("GET /{token}/nothing"), &[own]), 404);
    let upgrade = [
        own,
        ("Upgrade", "websocket"),
        ("Sec-WebSocket-Version", "13"),
        ("Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ=="),
    ];
    let socket = format!("GET /{token}/socket");
    assert_eq!(served.status(&socket, &upgrade), 403, "without an origin");
    let foreign: Vec<_> = upgrade.iter().copied().chain([("Origin", "http://evil.example")]).collect();
    assert_eq!(served.status(&socket, &foreign), 403);
}

#[test]
fn malformed_messages_are_refused_and_the_next_is_heard() {
    let room = Room::new("view-messages");
    let served = Served::start(&room, "200");
    let mut socket = served.socket();
    let name = socket.hear_of("scene")["name"].clone();
    socket.hear_of("caught_up");
    let deep = "[".repeat(100_000);
    let nameless = r#"{"kind":"bookmark","camera":{"name":"","matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],"fov":1}}"#;
    for (wrong, code) in [
        ("", "message"),
        ("{", "message"),
        ("\u{0}", "message"),
        (r#"{"kind":"nothing"}"#, "message"),
        (r#"{"kind":"edit","edit":{"delete":{"object":77777}}}"#, "edit"),
        (nameless, "camera"),
        (&deep, "message"),
    ] {
        socket.say(wrong);
        let refused = socket.hear_of("refused");
        assert_eq!(refused["code"], code, "{refused}");
        assert!(!refused["message"].as_str().unwrap().is_empty());
    }
    // Longer than a message may be is told; far longer ends the connection unread, and others do not notice.
    socket.say(&"x".repeat(3 << 19));
    assert_eq!(socket.hear_of("refused")["code"], "message");
    let mut other = served.socket();
    socket.say(&"x".repeat(3 << 20));
    while socket.hear().is_some() {}
    other.say(r#"{"kind":"layer","layer":"total","epoch":1}"#);
    other.hear_of("caught_up");
    other.say(r#"{"kind":"nothing"}"#);
    other.hear_of("refused");
    assert_eq!(served.socket().hear_of("scene")["name"], name);
}

#[test]
fn a_page_that_does_not_read_holds_nobody_back() {
    let room = Room::new("view-slow");
    // Each change is then 100 kB of light, more in all than the system keeps for a reader.
    let served = Served::start(&room, "20000");
    let mut slow = served.socket();
    slow.say(r#"{"kind":"layer","layer":"total","epoch":1}"#);
    let mut quick = served.socket();
    quick.say(r#"{"kind":"layer","layer":"total","epoch":1}"#);
    quick.hear_of("caught_up");
    for step in 0..200 {
        let dimming = 1.0 - f64::from(step) / 400.0;
        quick.say(&format!(
            r#"{{"kind":"edit","edit":{{"light":{{"light":0,"dimming":{dimming},"colour":[1,1,1]}}}},"gesture":1}}"#
        ));
    }
    loop {
        let light = quick.hear_of("light");
        if light["dimming"].as_f64().is_some_and(|dimming| (dimming - (1.0 - 199.0 / 400.0)).abs() < 1e-6) {
            break;
        }
    }
    slow.0.shutdown(Shutdown::Both).unwrap();
}

#[cfg(unix)]
#[test]
fn an_interrupt_ends_it_well() {
    let room = Room::new("view-interrupt");
    let mut served = Served::start(&room, "200");
    let mut socket = served.socket();
    socket.hear_of("caught_up");
    let kill = std::process::Command::new("kill").args(["-INT", &served.child.id().to_string()]).status().unwrap();
    assert!(kill.success());
    let mut rest = String::new();
    served.out.read_to_string(&mut rest).unwrap();
    assert_eq!(served.child.wait().unwrap().code(), Some(0), "{rest}");
}

#[test]
fn a_port_that_is_taken_is_a_wrong_call() {
    let room = Room::new("view-port");
    let served = Served::start(&room, "200");
    let run = room.run(["view", "--no-open", "--port", &served.port.to_string()]);
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.err.contains("cannot listen there"), "{run:?}");
}
