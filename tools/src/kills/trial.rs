//! One trial: a run is killed at random moments, resumed until it is done, and its files are compared with those of an undisturbed run.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use isotherm::internals::{RunState, decode};
use serde_json::Value;

use super::craft::write_model;

/// A transition with shadows and three joints, two of them with a rate.
pub const TRANSITION: &str = include_str!("transition.toml");
/// A network with two thermostats and a contact.
pub const NETWORK: &str = include_str!("network.toml");

/// Signals that end a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Signal {
    /// Nothing can be done about it.
    Kill,
    /// As a batch system ends a job.
    Terminate,
    /// As Ctrl-C.
    Interrupt,
}

impl Signal {
    /// All, in the order in which they are sent.
    pub const ALL: [Self; 3] = [Self::Kill, Self::Terminate, Self::Interrupt];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Kill => "KILL",
            Self::Terminate => "TERM",
            Self::Interrupt => "INT",
        }
    }

    fn send(self, child: &Child) {
        // The shell has a built-in kill. A minimal Debian has no such program.
        let command = format!("kill -{} {}", self.name(), child.id());
        let _ = Command::new("sh").args(["-c", &command]).stderr(Stdio::null()).status();
    }
}

/// A scene on a device, in a folder of its own, with the undisturbed run.
pub struct Trial {
    /// The built program.
    pub program: PathBuf,
    folder: PathBuf,
    device: Option<String>,
    /// Wall time of the undisturbed run.
    pub took: Duration,
    whole: BTreeMap<String, Vec<u8>>,
}

/// What a trial met.
#[derive(Debug, Default)]
pub struct Met {
    /// Kills by signal.
    pub kills: BTreeMap<&'static str, u32>,
    /// Kills before a state was saved. The run was begun anew.
    pub before_a_state: u32,
    /// Kills after which the run went on with its warm-up.
    pub in_warm_up: u32,
    /// Files that were compared.
    pub files: usize,
    /// Runs that were done.
    pub runs: u32,
}

impl Trial {
    /// Writes a scene of so many steps into a folder and runs it undisturbed.
    ///
    /// # Errors
    /// The program fails.
    pub fn new(program: &Path, folder: &Path, scene: &str, steps: u32, device: Option<&str>) -> Result<Self, String> {
        write_model(folder).map_err(|error| error.to_string())?;
        let scene = scene.replace("steps = 100", &format!("steps = {steps}"));
        fs::write(folder.join("scene.toml"), scene).map_err(|error| error.to_string())?;
        let mut trial = Self {
            program: program.to_path_buf(),
            folder: folder.to_path_buf(),
            device: device.map(str::to_owned),
            took: Duration::ZERO,
            whole: BTreeMap::new(),
        };
        let began = Instant::now();
        let (status, said) = trial.start(&["run", "scene.toml", "-o", "whole"])?.wait()?;
        if !status.success() {
            return Err(format!("the undisturbed run failed: {said}"));
        }
        trial.took = began.elapsed();
        trial.whole = files(&folder.join("whole"));
        Ok(trial)
    }

    /// Kills runs so many times, resumes each until it is done, and compares its files. `first` is the number of the first kill. A signal that comes
    /// after the end of a run does not count.
    ///
    /// # Errors
    /// The program fails, or a file differs.
    pub fn run(&self, kills: u32, first: u32, random: &mut dyn FnMut() -> f64) -> Result<Met, String> {
        let torn = self.folder.join("torn");
        let _ = fs::remove_dir_all(&torn);
        let mut met = Met::default();
        let (mut number, mut missed) = (first, 0);
        while number < first + kills {
            let signal = Signal::ALL[number as usize % Signal::ALL.len()];
            let running = self.go_on(&torn, &mut met)?;
            let pause = self.took.mul_f64(0.03 + 0.4 * random());
            std::thread::sleep(pause);
            signal.send(&running.child);
            let (status, said) = running.wait()?;
            if status.success() {
                self.done(&torn, &mut met)?;
                missed += 1;
                if missed > 10 * kills {
                    return Err(format!("SIG{} does not end a run", signal.name()));
                }
                continue;
            }
            number += 1;
            *met.kills.entry(signal.name()).or_default() += 1;
            if status.code().is_some_and(|code| code != 1 && code != 130) {
                return Err(format!("after SIG{} the program ended with {status}: {said}", signal.name()));
            }
            let parts = files(&torn).into_keys().filter(|name| name.contains("part-") || name.ends_with(".part"));
            let left: Vec<String> = parts.collect();
            if signal != Signal::Kill && !left.is_empty() {
                return Err(format!("SIG{} left {}", signal.name(), left.join(", ")));
            }
        }
        let (status, said) = self.go_on(&torn, &mut met)?.wait()?;
        if !status.success() {
            return Err(format!("the last part of the run failed: {said}"));
        }
        self.done(&torn, &mut met)?;
        Ok(met)
    }

    /// Compares the files of a run that is done, and removes them.
    fn done(&self, torn: &Path, met: &mut Met) -> Result<(), String> {
        met.files += self.compare(&files(torn))?;
        met.runs += 1;
        fs::remove_dir_all(torn).map_err(|error| error.to_string())
    }

    /// Resumes a run, or begins it where it has saved no state.
    fn go_on(&self, torn: &Path, met: &mut Met) -> Result<Running, String> {
        let manifest = fs::read_to_string(torn.join(".isotherm/manifest")).unwrap_or_default();
        let finished = manifest.contains("\"finished\":true");
        if finished || torn.join(".isotherm/state").exists() {
            let bytes = fs::read(torn.join(".isotherm/state")).unwrap_or_default();
            let in_warm_up = decode::<RunState>(&bytes).is_ok_and(|state| state.is_in_warm_up());
            met.in_warm_up += u32::from(in_warm_up);
            return self.start(&["run", "--resume", "torn", "--save-every", "40steps"]);
        }
        met.before_a_state += u32::from(torn.exists());
        self.start(&["run", "scene.toml", "-o", "torn", "--force", "--save-every", "40steps"])
    }

    fn start(&self, arguments: &[&str]) -> Result<Running, String> {
        let mut command = Command::new(&self.program);
        command.args(arguments).current_dir(&self.folder).stdin(Stdio::null());
        if let Some(device) = &self.device {
            command.args(["--device", device]);
        }
        let said = self.folder.join("said");
        let out = fs::File::create(&said).map_err(|error| error.to_string())?;
        let error = out.try_clone().map_err(|error| error.to_string())?;
        let child = command.stdout(out).stderr(error).spawn().map_err(|error| error.to_string())?;
        Ok(Running { child, said })
    }

    /// Compares all files with those of the undisturbed run. Returns their number.
    fn compare(&self, torn: &BTreeMap<String, Vec<u8>>) -> Result<usize, String> {
        let own = |files: &BTreeMap<String, Vec<u8>>| -> BTreeMap<String, Vec<u8>> {
            let own = files.iter().filter(|(name, _)| !name.starts_with(".isotherm/"));
            own.map(|(name, bytes)| (name.clone(), without_times(name, bytes))).collect()
        };
        let (whole, torn) = (own(&self.whole), own(torn));
        if !whole.keys().eq(torn.keys()) {
            return Err(format!("other files: {:?} and {:?}", whole.keys(), torn.keys()));
        }
        match whole.iter().find(|(name, bytes)| torn[*name] != **bytes) {
            Some((name, bytes)) => {
                let other = &torn[name];
                let at = bytes.iter().zip(other).take_while(|(a, b)| a == b).count();
                let around = |bytes: &[u8]| {
                    let end = bytes.len().min(at + 60);
                    String::from_utf8_lossy(&bytes[at.saturating_sub(60).min(end)..end]).into_owned()
                };
                let [here, there] = [around(bytes), around(other)];
                Err(format!("{name} differs from that of the undisturbed run at byte {at}: '{here}' and '{there}'"))
            }
            None => Ok(whole.len()),
        }
    }
}

struct Running {
    child: Child,
    said: PathBuf,
}

impl Running {
    fn wait(mut self) -> Result<(ExitStatus, String), String> {
        let status = self.child.wait().map_err(|error| error.to_string())?;
        Ok((status, fs::read_to_string(self.said).unwrap_or_default()))
    }
}

/// Every file below a folder, by relative path.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(next) = folders.pop() {
        for path in fs::read_dir(&next).into_iter().flatten().flatten().map(|entry| entry.path()) {
            if path.is_dir() {
                folders.push(path);
            } else if let Ok(name) = path.strip_prefix(folder) {
                found.insert(name.to_string_lossy().into_owned(), fs::read(&path).unwrap_or_default());
            }
        }
    }
    found
}

/// The bytes of a file without the wall-clock times of a report.
fn without_times(name: &str, bytes: &[u8]) -> Vec<u8> {
    match name {
        "report.json" => {
            let mut report: Value = serde_json::from_slice(bytes).unwrap_or_default();
            // The two runs have other folders and other options.
            report["command_line"] = Value::Null;
            let details = report["device"]["details"].as_array_mut().into_iter().flatten();
            details.filter(|detail| detail[0] == "start-up" || detail[0] == "stepping and drawing").for_each(
                |detail| {
                    detail[1] = Value::Null;
                },
            );
            for group in report["settings"].as_array_mut().into_iter().flatten() {
                let entries = group["entries"].as_array_mut().into_iter().flatten();
                entries.filter(|entry| entry[0] == "device time of a step [ns a node]").for_each(|entry| {
                    entry[1] = Value::Null;
                });
            }
            for (name, figure) in report["speed"].as_object_mut().into_iter().flatten() {
                if name != "steps" && name != "images" {
                    *figure = Value::Null;
                }
            }
            // Passes are timed in some frames only, and a run that goes on times others.
            report["passes"] = Value::Null;
            report.to_string().into_bytes()
        }
        // The page shows what report.json holds, so its digits, the times of its passes and its works are left out. Its words and pictures stay.
        "report.html" => {
            let mut text = String::from_utf8_lossy(bytes).into_owned();
            for head in ["<h2>Where the time went</h2>", "<h2>Time on the device</h2>"] {
                if let Some((before, rest)) = text.split_once(head) {
                    text = before.to_owned() + rest.split_once("</table>").map_or("", |(_, after)| after);
                }
            }
            let own = |line: &&str| ["isotherm run", "device time of a step"].iter().any(|text| line.contains(text));
            let lines = text.lines().filter(|line| !own(line));
            lines.collect::<String>().bytes().filter(|byte| !byte.is_ascii_digit() && !b".-".contains(byte)).collect()
        }
        _ => bytes.to_vec(),
    }
}
