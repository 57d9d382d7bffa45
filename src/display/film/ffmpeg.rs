//! MP4 and WebM, by the program ffmpeg. It runs as a child process and gets the frames through a pipe.
//!
//! The child has a process group of its own: Ctrl-C in a terminal ends this program alone, which then ends the child. The child also ends when this program is
//! killed, as its pipe ends.

use super::writer::{FilmSpec, FilmWriter, check_frame, write_failed};
use crate::display::tone::Palette;
use crate::{ChainError, Result, ensure};
use std::io::{ErrorKind, Read, Write};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

/// The package that brings the program.
pub(super) const PACKAGE: &str = "ffmpeg";
/// Most bytes of the messages of ffmpeg that are kept.
const KEPT: usize = 4096;
/// The number of threads decides the bytes of a film, so it is always the same.
const THREADS: &str = "2";

/// The children that run.
static RUNNING: Mutex<Vec<Arc<Mutex<Child>>>> = Mutex::new(Vec::new());

/// End all encoders that run, because a signal ends the program. A thread that writes a film then waits for that end, and reports no error of the encoder.
pub fn end_encoders() {
    let running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner);
    for child in running.iter() {
        let mut child = child.lock().unwrap_or_else(PoisonError::into_inner);
        // A child that has ended already needs no end.
        let _ = child.kill();
        let _ = child.wait();
    }
    std::mem::forget(running);
}

/// A film that a child process writes.
#[derive(Debug)]
struct Encoder {
    child: Arc<Mutex<Child>>,
    pipe: Option<ChildStdin>,
    said: Option<JoinHandle<Vec<u8>>>,
    pixels: usize,
    /// Colours, where the film is not grey.
    palette: Option<Palette>,
    rgb: Vec<u8>,
}

pub(super) fn create_mp4(path: &Path, spec: &FilmSpec) -> Result<Box<dyn FilmWriter>> {
    // Players need the index at the beginning, and even sides.
    let codec = ["-c:v", "libx264", "-preset", "medium", "-crf", "18", "-movflags", "+faststart", "-f", "mp4"];
    create(path, spec, &codec)
}

pub(super) fn create_webm(path: &Path, spec: &FilmSpec) -> Result<Box<dyn FilmWriter>> {
    let codec = ["-c:v", "libvpx-vp9", "-crf", "24", "-b:v", "0", "-deadline", "good", "-cpu-used", "5", "-row-mt", "0", "-f", "webm"];
    create(path, spec, &codec)
}

fn create(path: &Path, spec: &FilmSpec, codec: &[&str]) -> Result<Box<dyn FilmWriter>> {
    let palette = (!spec.palette.is_grey()).then(|| spec.palette.clone());
    let (frames, seconds) = spec.rate.fraction();
    let mut command = Command::new("ffmpeg");
    command
        .args(["-hide_banner", "-nostdin", "-loglevel", "error", "-y", "-f", "rawvideo"])
        .args(["-pixel_format", if palette.is_some() { "rgb24" } else { "gray" }])
        .args(["-video_size", &format!("{}x{}", spec.width, spec.height), "-framerate", &format!("{frames}/{seconds}"), "-i", "pipe:0"])
        .args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p", "-threads", THREADS])
        .args(codec)
        // Without the version of the encoder, so that a film depends on its frames alone.
        .args(["-fflags", "+bitexact", "-flags:v", "+bitexact", "-metadata", &format!("comment={}", spec.history)])
        .arg(path)
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .process_group(0);
    let mut child = command.spawn().map_err(|e| not_started(&e))?;
    let pipe = child.stdin.take();
    // A thread reads the messages, as a child that cannot write them would wait for ever.
    let said = child.stderr.take().map(|errors| std::thread::spawn(move || last_bytes(errors)));
    let child = Arc::new(Mutex::new(child));
    RUNNING.lock().unwrap_or_else(PoisonError::into_inner).push(child.clone());
    Ok(Box::new(Encoder { child, pipe, said, pixels: spec.pixels(), palette, rgb: Vec::new() }))
}

fn not_started(error: &std::io::Error) -> ChainError {
    let text = match error.kind() {
        ErrorKind::NotFound => {
            format!(
                "a film of this kind needs the program ffmpeg, which is not installed: install the package {PACKAGE}, or write an animated PNG (-o NAME.png)"
            )
        }
        _ => format!("ffmpeg does not start: {error}; write an animated PNG (-o NAME.png) without it"),
    };
    ChainError::Other(text.into())
}

/// The last bytes of a stream.
fn last_bytes(mut stream: impl Read) -> Vec<u8> {
    let (mut kept, mut part) = (Vec::new(), [0; 1024]);
    while let Ok(n) = stream.read(&mut part) {
        if n == 0 {
            break;
        }
        kept.extend_from_slice(&part[..n]);
        kept.drain(..kept.len().saturating_sub(KEPT));
    }
    kept
}

impl Encoder {
    /// Wait for the child, which ends when its pipe has ended.
    fn end(&mut self) -> Result<()> {
        drop(self.pipe.take());
        let said = self.said.take().and_then(|thread| thread.join().ok()).unwrap_or_default();
        let status = self.child.lock().unwrap_or_else(PoisonError::into_inner).wait().map_err(write_failed)?;
        self.forget();
        let said = String::from_utf8_lossy(&said);
        let last = said.lines().map(str::trim).rfind(|line| !line.is_empty()).map_or(String::new(), |line| format!(": {line}"));
        ensure!(status.success(), ChainError::Other(format!("ffmpeg failed ({status}){last}").into()));
        Ok(())
    }

    fn forget(&self) {
        RUNNING.lock().unwrap_or_else(PoisonError::into_inner).retain(|other| !Arc::ptr_eq(other, &self.child));
    }
}

impl FilmWriter for Encoder {
    fn frame(&mut self, levels: &[u8]) -> Result<()> {
        check_frame(levels, self.pixels)?;
        let bytes = match &self.palette {
            None => levels,
            Some(palette) => {
                self.rgb.clear();
                self.rgb.extend(levels.iter().flat_map(|level| palette.color(*level)));
                &self.rgb
            }
        };
        let written = self.pipe.as_mut().map(|pipe| pipe.write_all(bytes));
        match written {
            Some(Ok(())) => Ok(()),
            // The child has ended, and its last message says why.
            Some(Err(e)) => Err(self.end().err().unwrap_or_else(|| write_failed(e))),
            None => Err(ChainError::Internal("a frame after the end of the film".into())),
        }
    }

    fn finish(mut self: Box<Self>) -> Result<()> {
        self.end()
    }
}

impl Drop for Encoder {
    fn drop(&mut self) {
        if self.pipe.take().is_some() {
            let mut child = self.child.lock().unwrap_or_else(PoisonError::into_inner);
            let _ = child.kill();
            let _ = child.wait();
        }
        self.forget();
    }
}
