//! The memory of the program for each pixel of an image.

use crate::program::Scratch;
use assert_cmd::cargo::CommandCargoExt as _;
use std::process::{Command, Stdio};
use std::time::Duration;

/// Largest resident size of the program in bytes, as the system knows it shortly before the program ends.
fn peak(s: &Scratch, line: &str) -> f64 {
    let mut command = Command::cargo_bin("cittert").unwrap();
    command.current_dir(s.path("")).args(line.split_whitespace()).env("HDF5_USE_FILE_LOCKING", "FALSE");
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let file = format!("/proc/{}/status", child.id());
    let mut most = 0.0;
    loop {
        let status = std::fs::read_to_string(&file).unwrap_or_default();
        if let Some(kib) = status.lines().find_map(|l| l.strip_prefix("VmHWM:")) {
            most = kib.trim().trim_end_matches("kB").trim().parse::<f64>().unwrap() * 1024.0;
        }
        if let Some(code) = child.try_wait().unwrap() {
            assert!(code.success(), "{line}");
            return most;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// The difference of two sizes leaves out what the program and the data need. Planes, beam and images need 5 to 12 bytes less than the limits
/// at these sizes; before images were in single precision CLEAN and maximum entropy needed 100 bytes more.
#[test]
#[cfg(target_os = "linux")]
fn an_image_takes_few_bytes_for_each_pixel() {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.012,0.005,1.0\n-0.004,0.009,0.5\n");
    s.ok("simulate --layout mm-spiral --scene s.csv --freq 94GHz --bandwidth 1GHz --noise --tsys 500K -o v.uvh5");
    for (command, most) in [
        ("dirty v.uvh5 -o a.fits", 16.0),
        ("clean v.uvh5 --algorithm clark --niter 300 --startmod never --hold-out 0 -o a", 48.0),
        ("clean v.uvh5 --algorithm hogbom --niter 300 --startmod never --hold-out 0 -o a", 48.0),
        // The first step is as large as any other.
        ("mem v.uvh5 --tolerance 1e9 --kkt 1 --hold-out 0 -o a", 95.0),
    ] {
        let of =
            |side: u32| peak(&s, &format!("{command} --size {side} --cell {}mrad --no-w --threads 2 --overwrite", 300.0 / f64::from(side)));
        let (small, large) = (768_u32, 1536_u32);
        let pixels = f64::from(large * large - small * small);
        let each = (of(large) - of(small)) / pixels;
        assert!(each > 4.0 && each < most, "{command}: {each} bytes for each pixel");
    }
}
