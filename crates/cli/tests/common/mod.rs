//! Running the program and talking to it. Everything here gives up in time.

#![allow(
    dead_code,
    unreachable_pub,
    clippy::allow_attributes,
    reason = "each test file uses a part of it"
)]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpStream};
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use serde_json::Value;

/// How long anything may take before a test fails.
pub const PATIENCE: Duration = Duration::from_secs(600);

/// What a run of the program gave.
#[derive(Debug)]
pub struct Ran {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl Ran {
    /// What it printed, which must be one JSON value and nothing else.
    #[track_caller]
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.stdout).unwrap_or_else(|e| panic!("{e}: {self:?}"))
    }

    /// Asserts that it failed, and that its message holds all these words.
    #[track_caller]
    pub fn failed_saying(&self, words: &[&str]) {
        assert_eq!(self.code, Some(1), "{self:?}");
        for word in words {
            assert!(self.stderr.contains(word), "{word:?} is missing: {self:?}");
        }
    }
}

/// Runs the program to its end.
#[track_caller]
pub fn run(arguments: &[&str]) -> Ran {
    run_with(arguments, &[])
}

/// Runs the program to its end, with environment variables of its own.
#[track_caller]
pub fn run_with(arguments: &[&str], environment: &[(&str, &str)]) -> Ran {
    let mut program = Program::start_with(arguments, environment);
    let stdout = program.read(Pipe::Stdout);
    let stderr = program.read(Pipe::Stderr);
    let status = program.wait();
    Ran {
        code: status.code(),
        stdout: stdout.join().expect("readable output"),
        stderr: stderr.join().expect("readable output"),
    }
}

enum Pipe {
    Stdout,
    Stderr,
}

/// A running program, killed when dropped.
pub struct Program(Child);

impl Program {
    pub fn start(arguments: &[&str]) -> Self {
        Self::start_with(arguments, &[])
    }

    pub fn start_with(arguments: &[&str], environment: &[(&str, &str)]) -> Self {
        let child = Command::new(env!("CARGO_BIN_EXE_lumencast"))
            .args(arguments)
            .env_remove("RUST_LOG")
            .env_remove("LUMENCAST_PAGE")
            .envs(environment.iter().copied())
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        Self(child)
    }

    fn read(&mut self, pipe: Pipe) -> JoinHandle<String> {
        let mut pipe: Box<dyn Read + Send> = match pipe {
            Pipe::Stdout => Box::new(self.0.stdout.take().expect("piped, and not taken yet")),
            Pipe::Stderr => Box::new(self.0.stderr.take().expect("piped, and not taken yet")),
        };
        thread::spawn(move || {
            let mut text = String::new();
            pipe.read_to_string(&mut text).expect("UTF-8");
            text
        })
    }

    /// What it says on standard error up to the line that holds a word.
    #[track_caller]
    pub fn stderr_until(&mut self, word: &str) -> String {
        let stderr = self.0.stderr.take().expect("piped, and not taken yet");
        let (send, lines) = mpsc::channel();
        thread::spawn(move || {
            for line in BufReader::new(stderr).lines().map_while(Result::ok) {
                let _ = send.send(line);
            }
        });
        let mut said = String::new();
        while !said.contains(word) {
            let line = lines.recv_timeout(PATIENCE);
            said += &line.unwrap_or_else(|_| panic!("{word:?} is never said: {said}"));
            said.push('\n');
        }
        said
    }

    /// Waits for its end.
    #[track_caller]
    pub fn wait(&mut self) -> ExitStatus {
        let began = Instant::now();
        loop {
            if let Some(status) = self.0.try_wait().expect("a child can be waited for") {
                return status;
            }
            assert!(began.elapsed() < PATIENCE, "the program does not end");
            thread::sleep(Duration::from_millis(5));
        }
    }

    /// Reads what it tells until a line holds this.
    #[track_caller]
    pub fn wait_for(&mut self, word: &str) {
        let stderr = self.0.stderr.take().expect("piped, and not taken yet");
        let (send, lines) = mpsc::channel();
        thread::spawn(move || {
            BufReader::new(stderr)
                .lines()
                .map_while(Result::ok)
                .try_for_each(|line| send.send(line))
        });
        let began = Instant::now();
        let mut told = Vec::new();
        while let Ok(line) = lines.recv_timeout(PATIENCE.saturating_sub(began.elapsed())) {
            if line.contains(word) {
                return;
            }
            told.push(line);
        }
        panic!("nothing tells of {word:?}: {told:#?}");
    }

    /// Sends it Ctrl-C.
    pub fn interrupt(&self) {
        let pid = self.0.id().to_string();
        let sent = Command::new("kill").args(["-INT", &pid]).status().expect("kill can be run");
        assert!(sent.success());
    }

    pub fn kill(&mut self) {
        self.0.kill().expect("a child can be killed");
        self.wait();
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A running server.
pub struct Serving {
    pub program: Program,
    pub address: SocketAddr,
    pub ready: Value,
}

impl Serving {
    /// Serves a scene on a free port of loopback.
    #[track_caller]
    pub fn start(scene: &str, arguments: &[&str]) -> Self {
        Self::on(scene, 0, arguments)
    }

    /// Serves a scene on this port.
    #[track_caller]
    pub fn on(scene: &str, port: u16, arguments: &[&str]) -> Self {
        let listen = SocketAddr::from((Ipv4Addr::LOCALHOST, port)).to_string();
        let mut all = vec!["serve", scene, "--listen", &listen, "--json"];
        all.extend(arguments);
        let mut program = Program::start(&all);
        let stdout = program.0.stdout.take().expect("piped");
        let (send, lines) = mpsc::channel();
        thread::spawn(move || {
            for line in BufReader::new(stdout).lines().map_while(Result::ok) {
                let _ = send.send(line);
            }
        });
        let line = lines.recv_timeout(PATIENCE).unwrap_or_else(|_| {
            let _ = program.0.kill();
            let stderr = program.read(Pipe::Stderr).join().unwrap_or_default();
            panic!("the server is not ready: {stderr}")
        });
        let ready: Value = serde_json::from_str(&line).expect("a line of JSON");
        let port = ready["port"].as_u64().and_then(|p| u16::try_from(p).ok()).expect("a port");
        Self { program, address: SocketAddr::from((Ipv4Addr::LOCALHOST, port)), ready }
    }

    /// The address of its scene, for clients.
    pub fn url(&self) -> String {
        format!("http://{}/{}", self.address, self.ready["scene"].as_str().expect("a name"))
    }

    /// Asks for a path as a browser would that opened the page.
    #[track_caller]
    pub fn get(&self, path: &str) -> Answer {
        self.request(path, &[("Host", &self.address.to_string())])
    }

    /// Asks for a path with these headers.
    #[track_caller]
    pub fn request(&self, path: &str, headers: &[(&str, &str)]) -> Answer {
        let mut stream = TcpStream::connect(self.address).expect("the server listens");
        stream.set_read_timeout(Some(PATIENCE)).expect("a time-out");
        let mut request = format!("GET {path} HTTP/1.1\r\nConnection: close\r\n");
        for (name, value) in headers {
            request += &format!("{name}: {value}\r\n");
        }
        request += "\r\n";
        stream.write_all(request.as_bytes()).expect("the request is taken");
        let mut bytes = Vec::new();
        stream.read_to_end(&mut bytes).expect("an answer");
        let split = bytes.windows(4).position(|w| w == b"\r\n\r\n").expect("a head");
        let head = String::from_utf8(bytes[..split].to_vec()).expect("a head of text");
        let status = head.split(' ').nth(1).and_then(|s| s.parse().ok()).expect("a status");
        Answer { status, head: head.to_ascii_lowercase(), body: bytes.split_off(split + 4) }
    }

    /// The value of a metric without labels.
    #[track_caller]
    pub fn metric(&self, name: &str) -> f64 {
        let text = self.get("/metrics").text();
        let line = text.lines().find_map(|line| line.strip_prefix(&format!("{name} ")));
        line.and_then(|value| value.parse().ok()).unwrap_or_else(|| panic!("no {name}: {text}"))
    }

    /// Waits until a metric fulfils a condition.
    #[track_caller]
    pub fn wait_for_metric(&self, name: &str, condition: impl Fn(f64) -> bool) {
        let began = Instant::now();
        while !condition(self.metric(name)) {
            assert!(began.elapsed() < PATIENCE, "{name} stays at {}", self.metric(name));
            thread::sleep(Duration::from_millis(20));
        }
    }
}

/// An answer of the server.
#[derive(Debug)]
pub struct Answer {
    pub status: u16,
    /// Status line and headers, in lower case.
    pub head: String,
    pub body: Vec<u8>,
}

impl Answer {
    pub fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }
}

/// A folder of its own for a test, removed when dropped.
pub struct Folder(pub PathBuf);

impl Folder {
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("lumencast-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).expect("a folder for temporary files");
        Self(path)
    }

    /// Writes a file into it.
    pub fn file(&self, name: &str, contents: &[u8]) -> String {
        let path = self.0.join(name);
        std::fs::write(&path, contents).expect("a temporary file");
        path.to_str().expect("a path of text").to_owned()
    }

    /// Writes NAME.gltf with its buffer beside it: a mesh named "odd" of these triangles, two-sided,
    /// that reflects half of the light and emits as much as it is asked to, under a sun.
    pub fn triangles(&self, name: &str, corners: &[[f32; 3]], emission: f32) -> String {
        let bytes: Vec<u8> = corners.iter().flatten().flat_map(|c| c.to_le_bytes()).collect();
        self.file(&format!("{name}.bin"), &bytes);
        let scene = serde_json::json!({
            "asset": { "version": "2.0" },
            "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_emissive_strength"],
            "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "directional" }] } },
            "buffers": [{ "uri": format!("{name}.bin"), "byteLength": bytes.len() }],
            "bufferViews": [{ "buffer": 0, "byteLength": bytes.len() }],
            "accessors": [{
                "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": corners.len(),
            }],
            "materials": [{
                "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.5, 0.5, 1.0] },
                "emissiveFactor": [1.0, 1.0, 1.0],
                "doubleSided": true,
                "extensions": {
                    "KHR_materials_emissive_strength": { "emissiveStrength": emission },
                },
            }],
            "meshes": [{
                "name": "odd", "primitives": [{ "attributes": { "POSITION": 0 }, "material": 0 }],
            }],
            "nodes": [
                { "mesh": 0 },
                { "extensions": { "KHR_lights_punctual": { "light": 0 } } },
            ],
            "scenes": [{ "nodes": [0, 1] }],
        });
        self.file(&format!("{name}.gltf"), scene.to_string().as_bytes())
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
