//! Who is served, and what.

use super::{Designer, names, program};
use std::net::TcpStream;
use std::os::unix::process::ExitStatusExt as _;

#[test]
fn the_page_is_served_with_its_policy_and_nothing_is_fetched_from_elsewhere() {
    let d = Designer::start(&[]);
    let host = d.host();
    for (name, kind) in [("", "text/html"), ("page.js", "text/javascript"), ("page.css", "text/css")] {
        let (head, body) = d.get(&format!("/{}/{name}", d.token), &[("Host", &host)]);
        let head = head.to_ascii_lowercase();
        assert!(head.starts_with("http/1.1 200") && head.contains(&format!("content-type: {kind}")), "{name}: {head}");
        let policy = head.lines().find_map(|l| l.strip_prefix("content-security-policy: ")).unwrap();
        assert!(policy.contains("default-src 'none'") && policy.contains("script-src 'self'"), "{policy}");
        assert!(!policy.contains("unsafe") && !policy.contains('*') && !policy.contains("http"), "{policy}");
        for header in ["x-content-type-options: nosniff", "referrer-policy: no-referrer", "cache-control: no-store"] {
            assert!(head.contains(header), "{head}");
        }
        assert!(!body.is_empty());
        // Names of other machines stand in licences and in name spaces of SVG only.
        let loads = ["src=\"http", "href=\"http", "url(http", "@import", "import(\"http", "eval("];
        assert!(loads.iter().all(|l| !body.contains(l)), "{name}");
    }
    assert!(d.get(&format!("/{}/page/src", d.token), &[("Host", &host)]).0.starts_with("HTTP/1.1 403"));
    assert!(d.get(&format!("/{}/other.js", d.token), &[("Host", &host)]).0.starts_with("HTTP/1.1 404"));
}

#[test]
fn strangers_are_refused() {
    let d = Designer::start(&[]);
    let (host, port, page) = (d.host(), d.port, format!("/{}/", d.token));
    let refused = |path: &str, headers: &[(&str, &str)], word: &str| {
        let (head, body) = d.get(path, headers);
        assert!(head.starts_with("HTTP/1.1 403") && body.contains(word), "{path} {headers:?}: {head}\n{body}");
    };
    let wrong = format!("/{}/", "0".repeat(32));
    for path in ["/", "/page.js", wrong.as_str(), "/x/page.js", "//", "/%00/"] {
        refused(path, &[("Host", &host)], "token");
    }
    let other = format!("localhost.evil.example:{port}");
    for name in ["evil.example", other.as_str(), "127.0.0.1", "127.0.0.1:1"] {
        refused(&page, &[("Host", name)], "127.0.0.1 and localhost only");
    }
    refused(&page, &[("Host", &host), ("Origin", "http://evil.example")], "only the page");
    assert!(d.get(&page, &[("Host", &format!("localhost:{port}"))]).0.starts_with("HTTP/1.1 200"));
    let own = format!("http://{host}");
    let socket = |token: &str, host: &str, origin: &str| d.socket(token, host, origin).err();
    assert!(socket(&d.token, &host, &own).is_none());
    for (token, host, origin) in [
        ("x", host.as_str(), own.as_str()),
        (&d.token, "evil.example", &own),
        (&d.token, &host, "http://evil.example"),
        (&d.token, &host, "null"),
        (&d.token, &host, "http://127.0.0.1"),
    ] {
        let why = socket(token, host, origin).unwrap();
        assert!(why.contains("403"), "{token} {host} {origin}: {why}");
    }
    // A request of the address of the socket that opens none.
    assert!(d.get(&format!("/{}/socket", d.token), &[("Host", &host), ("Origin", &own)]).0.starts_with("HTTP/1.1 400"));
}

#[test]
fn other_machines_cannot_reach_it() {
    let d = Designer::start(&[]);
    let tcp = std::fs::read_to_string("/proc/net/tcp").unwrap() + &std::fs::read_to_string("/proc/net/tcp6").unwrap();
    let port = format!(":{:04X} ", d.port);
    // Sockets that listen are in the state 0A.
    let listening: Vec<&str> = tcp.lines().filter(|l| l.contains(&port) && l.contains(" 0A ")).collect();
    assert_eq!(listening.len(), 1, "{tcp}");
    assert!(listening[0].contains(&format!(" 0100007F{port}")), "{}", listening[0]);
}

#[test]
fn a_signal_leaves_nothing() {
    for (signal, number) in [("-INT", 2), ("-TERM", 15), ("-HUP", 1)] {
        let mut d = Designer::start(&[]);
        let mut tab = d.tab();
        let header = serde_json::json!({ "kind": "scene", "name": "s.csv" });
        tab.drop_file(&header, b"l_rad,m_rad,flux_jy\n0,0,1\n");
        assert_eq!(tab.until("scenes")["added"], "s.csv");
        assert_eq!(names(d.folder.path()).len(), 1);
        let status = d.end(signal);
        assert_eq!(status.signal(), Some(number), "{signal}");
        assert_eq!(names(d.folder.path()), [""; 0], "{signal}");
        assert!(TcpStream::connect(("127.0.0.1", d.port)).is_err());
    }
}

#[test]
fn a_port_in_use_and_wrong_words_are_one_clear_error() {
    let d = Designer::start(&[]);
    let says = |words: &[&str]| {
        let folder = tempfile::tempdir().unwrap();
        let said = program().args(["design", "--no-open"]).args(words).env("TMPDIR", folder.path()).output().unwrap();
        assert_eq!(names(folder.path()), [""; 0]);
        (said.status.code().unwrap(), String::from_utf8(said.stderr).unwrap())
    };
    let (code, text) = says(&["--port", &d.port.to_string()]);
    assert!(code == 1 && text.contains(&format!("--port {}", d.port)) && text.contains("0 for a free one"), "{text}");
    let (code, text) = says(&["no-such-layout"]);
    assert!(code != 0 && text.contains("no-such-layout"), "{text}");
    let (code, text) = says(&["--scene", "no-such-scene.png"]);
    assert!(code == 1 && text.contains("no-such-scene.png"), "{text}");
    let (code, text) = says(&["--port", "65536"]);
    assert!(code == 2 && text.contains("--port"), "{text}");
}
