//! A running server as seen over HTTP and by signals.

mod common;

use std::io::Write;
use std::net::{TcpListener, TcpStream, UdpSocket};

use common::{Folder, Serving, run};
use lumencast_picture::Loaded;

#[test]
fn answers_over_http() {
    let server = Serving::start("cornell", &["--volume", "2x2x2"]);
    let start = server.get("/lumencast.json");
    assert_eq!(start.status, 200);
    let start: serde_json::Value = serde_json::from_slice(&start.body).expect("JSON");
    assert_eq!((&start["scene"], &start["broadcast"]), (&"cornell".into(), &"cornell".into()));
    assert!(start["tick"].is_u64(), "{start}");

    let root = start["root"].as_str().expect("a name");
    let scene = server.get(&format!("/scene/{root}"));
    assert_eq!(scene.status, 200);
    assert_eq!(&scene.body[..4], b"glTF", "the built-in scene is served as the file that it is");
    assert!(scene.head.contains("content-type: model/gltf-binary"), "{}", scene.head);

    let page = server.get("/");
    assert_eq!(page.status, 200);
    for header in ["content-security-policy: default-src 'self'", "x-content-type-options: nosniff"]
    {
        assert!(page.head.contains(header), "{}", page.head);
    }
    assert_eq!(server.get("/healthz").status, 200);
    server.wait_for_metric("lumencast_ticks_total", |n| n > 2.0);
    assert!(server.metric("lumencast_rays_total") > 0.0);
    assert!(
        server.get("/metrics").text().contains("lumencast_stage_seconds_bucket{stage=\"gather\"")
    );
}

#[test]
fn serves_no_file_but_the_scenes_own() {
    let folder = Folder::new("allow-list");
    let secret = folder.file("secret.txt", b"secret");
    let server = Serving::start("cornell", &["--volume", "1x1x1"]);
    for path in [
        "/scene/secret.txt".to_owned(),
        "/scene/../secret.txt".to_owned(),
        "/scene/..%2fsecret.txt".to_owned(),
        "/scene/%2e%2e/%2e%2e/etc/passwd".to_owned(),
        "/../../../../etc/passwd".to_owned(),
        format!("/scene/{secret}"),
        format!("//{secret}"),
        "/scene/%00".to_owned(),
    ] {
        let answer = server.get(&path);
        assert!((400..500).contains(&answer.status), "{path}: {answer:?}");
        assert!(!answer.text().contains("root:") && !answer.text().contains("secret\n"), "{path}");
    }
}

#[test]
fn foreign_pages_and_names_are_turned_away() {
    let server = Serving::start("cornell", &["--volume", "1x1x1"]);
    let host = server.address.to_string();
    let foreign = [("Host", host.as_str()), ("Origin", "https://evil.example")];
    assert_eq!(server.request("/lumencast.json", &foreign).status, 403);
    assert_eq!(server.request("/lumencast.json", &[("Host", "evil.example")]).status, 403);
    let own = format!("http://{host}");
    assert_eq!(server.request("/lumencast.json", &[("Host", &host), ("Origin", &own)]).status, 200);
}

#[test]
fn a_page_from_a_folder() {
    let folder = Folder::new("page");
    folder.file("index.html", b"<!doctype html>here I am");
    let path = folder.0.to_str().expect("text").to_owned();
    let server = Serving::start("cornell", &["--volume", "1x1x1", "--page", &path]);
    let page = server.get("/");
    assert!(page.text().contains("here I am"), "{page:?}");
    assert!(page.head.contains("content-type: text/html"), "{page:?}");
    assert_eq!(server.get("/nothing.js").status, 404);
}

#[test]
fn ctrl_c_ends_it_with_0() {
    let mut server = Serving::start("cornell", &["--volume", "2x2x2"]);
    server.wait_for_metric("lumencast_ticks_total", |n| n > 0.0);
    server.program.interrupt();
    assert_eq!(server.program.wait().code(), Some(0));
}

#[test]
fn a_second_ctrl_c_ends_it_at_once() {
    let mut server = Serving::start("cornell", &["--volume", "2x2x2"]);
    server.wait_for_metric("lumencast_ticks_total", |n| n > 0.0);
    // A request that never ends holds the server up far longer than the time between two signals.
    let mut asking = TcpStream::connect(server.address).expect("a connection");
    asking.write_all(b"GET /healthz HTTP/1.1\r\n").expect("half a request");
    server.program.interrupt();
    std::thread::sleep(std::time::Duration::from_millis(300));
    server.program.interrupt();
    assert_eq!(server.program.wait().code(), Some(130));
}

#[test]
fn a_port_in_use_is_named() {
    let tcp = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let address = tcp.local_addr().expect("an address");
    let port = address.port().to_string();
    run(&["serve", "cornell", "--listen", &address.to_string()])
        .failed_saying(&[&port, "another program uses"]);

    let udp = UdpSocket::bind("127.0.0.1:0").expect("a free port");
    let address = udp.local_addr().expect("an address");
    run(&["serve", "cornell", "--listen", &address.to_string()])
        .failed_saying(&[&address.port().to_string(), "another program uses"]);
}

/// Lumels of a server: their layouts are had by hash, and clients see their light.
#[test]
fn lumels_are_cast_to_native_clients() {
    let folder = Folder::new("live-lumels");
    let [pages, picture] = ["pages", "a.exr"].map(|name| folder.0.join(name));
    std::fs::create_dir(&pages).expect("a folder");
    let text = |path: &std::path::Path| path.to_str().expect("text").to_owned();
    let fields = ["--volume", "2x2x2", "--lightmap", "64", "--fields", "lightmap,volume"];
    let stacked = ["--lumel-coding", "h264-stacked"];
    let server = Serving::start("cornell", &[&fields[..], &stacked].concat());
    let lumels = &server.ready["lumels"];
    assert_eq!((&lumels["pages"], &lumels["page_size"]), (&1.into(), &64.into()), "{lumels}");
    let url = server.url();
    server.wait_for_metric("lumencast_ticks_total", |n| n > 20.0);

    let report = run(&["inspect", &url, "--pages", &text(&pages), "--json"]);
    assert_eq!(report.code, Some(0), "{report:?}");
    let field = &report.json()["fields"][1];
    assert_eq!((&field["kind"], &field["pages"]), (&"lightmap".into(), &1.into()));
    assert!(field["lightmap"]["surfaces"].as_u64() >= Some(3), "{field}");
    assert!(field["lightmap"]["illuminance"]["mean"].as_f64() > Some(0.1), "{field}");
    let page = Loaded::read(pages.join("field1-page0.exr")).expect("a page").linear();
    assert!(page.pixels().iter().filter(|lumel| lumel.x > 0.1).count() > 64 * 64 / 2);

    let hash = field["layout"].as_str().expect("a hash");
    let layout = server.get(&format!("/resources/{hash}"));
    assert_eq!(layout.status, 200);
    assert!(layout.head.contains("immutable"), "{}", layout.head);
    for other in [&hash.replace(char::is_numeric, "0"), "nothing", "..%2f..%2fetc%2fpasswd"] {
        assert_eq!(server.get(&format!("/resources/{other}")).status, 404, "{other}");
    }

    let how = ["--lighting", "indirect", "--size", "32x24", "--exposure", "1", "--light", &url];
    let drawn = run(&[&["render", "cornell", "-o", &text(&picture), "--json"], &how[..]].concat());
    assert_eq!(drawn.code, Some(0), "{drawn:?}");
    assert_eq!(drawn.json()["pages"], 1);
}
