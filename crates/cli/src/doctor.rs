//! `lumencast doctor`: what this machine offers, and what is missing for what.

use std::ffi::OsStr;
use std::net::{Ipv4Addr, TcpListener, UdpSocket};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use std::{env, fs, thread};

use anyhow::Result;
use clap::Args;
use serde_json::{Value, json};

use crate::arguments::DEFAULT_PORT;
use crate::output::{self, say};

/// Says what this machine offers: system, processor, drivers, adapters, port, programs.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  lumencast doctor --json > doctor.json    to attach to a report")]
pub(crate) struct Doctor {
    /// Prints JSON only.
    #[arg(long)]
    json: bool,
    /// Prints the adapters only, as JSON: what `doctor` runs in a process of its own.
    #[arg(long, hide = true)]
    adapters: bool,
}

/// Programs that building and testing need, with what for.
const PROGRAMS: [(&str, &str, &str); 5] = [
    ("cargo", "--version", "builds the server"),
    ("node", "--version", "builds the page"),
    ("npm", "--version", "builds the page"),
    ("cc", "--version", "compiles the cryptography of QUIC"),
    ("chromium", "--version", "the browser tests"),
];

/// A program that says nothing for this long is taken to hang.
const PATIENCE: Duration = Duration::from_secs(10);

impl Doctor {
    pub(crate) fn run(self) -> Result<()> {
        if self.adapters {
            return output::json(&json!(enumerate_adapters()?));
        }
        let report = json!({
            "lumencast": env!("CARGO_PKG_VERSION"),
            "page": lumencast_server::page_is_embedded(),
            "system": system(),
            "processor": processor(),
            "drivers": vulkan_drivers(),
            "adapters": adapters(),
            "port": port(),
            "programs": programs(),
        });
        if self.json {
            return output::json(&report);
        }
        print_report(&report);
        Ok(())
    }
}

fn print_report(report: &Value) {
    let text = |pointer: &str| match report.pointer(pointer) {
        Some(Value::String(s)) => s.clone(),
        Some(Value::Null) | None => "unknown".to_owned(),
        Some(other) => other.to_string(),
    };
    let yes = |pointer: &str| report.pointer(pointer).and_then(Value::as_bool) == Some(true);

    say!("lumencast   {}", text("/lumencast"));
    let page = if yes("/page") { "compiled in" } else { "not compiled in: build web/viewer first" };
    say!("page        {page}");
    say!("system      {}, kernel {}", text("/system/name"), text("/system/kernel"));
    say!(
        "processor   {}, {} cores, rays are traced with {}",
        text("/processor/name"),
        text("/processor/cores"),
        text("/processor/rays"),
    );
    say!("memory      {} GiB", text("/system/memory_gib"));
    for driver in report["drivers"].as_array().into_iter().flatten() {
        say!("driver      {}", driver.as_str().unwrap_or_default());
    }
    match report["adapters"].as_array().map(Vec::as_slice) {
        None if !cfg!(feature = "gpu") => say!("adapter     not looked for by this build"),
        None => say!("adapter     unknown: a driver crashed or did not answer"),
        Some([]) => say!("adapter     none; light is computed on the processor without one"),
        Some(adapters) => adapters.iter().for_each(print_adapter),
    }
    say!("port {DEFAULT_PORT}   {}", text("/port/state"));
    for program in report["programs"].as_array().into_iter().flatten() {
        let version = program["version"].as_str().unwrap_or("not found");
        let name = program["name"].as_str().unwrap_or_default();
        say!("{name:<11} {version} ({})", program["purpose"].as_str().unwrap_or_default());
    }
}

fn print_adapter(adapter: &Value) {
    let text = |key: &str| adapter[key].as_str().unwrap_or_default();
    say!(
        "adapter     {} ({}, {}, driver {} {}), ray query {}",
        text("name"),
        text("kind"),
        text("backend"),
        text("driver"),
        text("driver_version"),
        if adapter["ray_query"] == true { "yes" } else { "no" },
    );
}

fn system() -> Value {
    let release = fs::read_to_string("/etc/os-release").unwrap_or_default();
    let name = release
        .lines()
        .find_map(|line| line.strip_prefix("PRETTY_NAME="))
        .map_or_else(|| env::consts::OS.to_owned(), |name| name.trim_matches('"').to_owned());
    let kernel = fs::read_to_string("/proc/sys/kernel/osrelease").ok();
    let memory = fs::read_to_string("/proc/meminfo").ok().and_then(|text| {
        let line = text.lines().find(|line| line.starts_with("MemTotal:"))?;
        line.split_whitespace().nth(1)?.parse::<f64>().ok()
    });
    json!({
        "name": name,
        "kernel": kernel.map(|k| k.trim().to_owned()),
        "memory_gib": memory.map(|kib| (kib / 1024.0 / 1024.0 * 10.0).round() / 10.0),
    })
}

fn processor() -> Value {
    let info = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = info
        .lines()
        .find(|line| line.starts_with("model name"))
        .and_then(|line| Some(line.split_once(':')?.1.trim().to_owned()))
        .unwrap_or_else(|| env::consts::ARCH.to_owned());
    #[cfg(target_arch = "x86_64")]
    let (avx2, fma) = (is_x86_feature_detected!("avx2"), is_x86_feature_detected!("fma"));
    #[cfg(not(target_arch = "x86_64"))]
    let (avx2, fma) = (false, false);
    let cores = thread::available_parallelism().map_or(1, |n| n.get());
    let rays = lumencast_gather::measure::instructions();
    json!({ "name": name, "cores": cores, "avx2": avx2, "fma": fma, "rays": rays })
}

/// Driver manifests where the Vulkan loader looks for them.
fn vulkan_drivers() -> Vec<PathBuf> {
    let mut drivers: Vec<PathBuf> = match env::var_os("VK_DRIVER_FILES") {
        Some(files) => env::split_paths(&files).collect(),
        None => ["/etc", "/usr/local/share", "/usr/share"]
            .iter()
            .map(|prefix| Path::new(prefix).join("vulkan/icd.d"))
            .filter_map(|folder| fs::read_dir(folder).ok())
            .flat_map(|entries| entries.filter_map(|entry| Some(entry.ok()?.path())))
            .filter(|path| path.extension().is_some_and(|e| e == "json"))
            .collect(),
    };
    drivers.sort();
    drivers
}

/// The adapters, asked for in a process of its own: a broken driver may crash or hang, and to say
/// so is what this command is for. The value is null then.
fn adapters() -> Value {
    let program = env::current_exe().unwrap_or_else(|_| PathBuf::from("lumencast"));
    first_output(program, &["doctor", "--adapters"])
        .and_then(|text| serde_json::from_str(&text).ok())
        .unwrap_or(Value::Null)
}

#[cfg(not(feature = "gpu"))]
fn enumerate_adapters() -> Result<Vec<Value>> {
    anyhow::bail!("{}", crate::absent::GPU)
}

/// Every adapter of the platform's own interfaces (Vulkan, Metal, Direct3D 12).
#[cfg(feature = "gpu")]
fn enumerate_adapters() -> Result<Vec<Value>> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapters = tokio::runtime::Builder::new_current_thread()
        .build()?
        .block_on(instance.enumerate_adapters(wgpu::Backends::all()));
    Ok(adapters.iter().map(describe_adapter).collect())
}

#[cfg(feature = "gpu")]
fn describe_adapter(adapter: &wgpu::Adapter) -> Value {
    let info = adapter.get_info();
    let kind = match info.device_type {
        wgpu::DeviceType::DiscreteGpu => "discrete GPU",
        wgpu::DeviceType::IntegratedGpu => "integrated GPU",
        wgpu::DeviceType::VirtualGpu => "virtual GPU",
        wgpu::DeviceType::Cpu => "software",
        wgpu::DeviceType::Other => "other",
    };
    json!({
        "name": info.name,
        "kind": kind,
        "backend": info.backend.to_str(),
        "driver": info.driver,
        "driver_version": info.driver_info,
        "ray_query": adapter.features().contains(wgpu::Features::EXPERIMENTAL_RAY_QUERY),
        "timestamps": adapter.features().contains(wgpu::Features::TIMESTAMP_QUERY),
        "largest_buffer_bytes": adapter.limits().max_buffer_size,
    })
}

/// Whether the default port is free, for HTTP (TCP) and for QUIC (UDP).
fn port() -> Value {
    let address = (Ipv4Addr::LOCALHOST, DEFAULT_PORT);
    let state = match (TcpListener::bind(address), UdpSocket::bind(address)) {
        (Ok(_), Ok(_)) => "free".to_owned(),
        (Err(error), _) | (_, Err(error)) => {
            format!("not free ({error}): give serve another one, --listen 127.0.0.1:PORT")
        }
    };
    json!({ "number": DEFAULT_PORT, "free": state == "free", "state": state })
}

fn programs() -> Vec<Value> {
    PROGRAMS
        .iter()
        .map(|&(name, argument, purpose)| {
            let version = first_output(name, &[argument])
                .and_then(|text| text.lines().next().map(|line| line.trim().to_owned()));
            json!({ "name": name, "version": version, "purpose": purpose })
        })
        .collect()
}

/// What a program prints, if there is such a program and it ends well in time.
fn first_output(program: impl AsRef<OsStr>, arguments: &[&str]) -> Option<String> {
    let mut child = Command::new(program)
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .ok()?;
    // Reading on a thread of its own: a full pipe must not keep the program from ending.
    let mut stdout = child.stdout.take()?;
    let reader = thread::spawn(move || std::io::read_to_string(&mut stdout).unwrap_or_default());
    let began = Instant::now();
    let status = loop {
        match child.try_wait().ok()? {
            Some(status) => break status,
            None if began.elapsed() > PATIENCE => {
                let _ = child.kill();
                let _ = child.wait();
                return None;
            }
            None => thread::sleep(Duration::from_millis(10)),
        }
    };
    status.success().then(|| reader.join().unwrap_or_default())
}
