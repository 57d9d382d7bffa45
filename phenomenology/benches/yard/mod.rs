//! A yard of solids for benches and figures, for the tracer and for POV-Ray, and the measurement of processor time.

use cittert_phenomenology::SolidScene;
use std::fmt::Write;

/// One solid of the yard: kind, place, size, and whether it is metal.
struct Item {
    kind: usize,
    x: f64,
    y: f64,
    r: f64,
    metal: bool,
}

/// Solids of five kinds, spread so that the picture always shows about the same share of them.
fn items(solids: usize) -> Vec<Item> {
    let columns = (solids as f64).sqrt().ceil();
    let pitch = 50.0 / columns;
    (0..solids)
        .map(|k| {
            let (x, y) = (pitch * (k as f64 % columns) - 25.0, pitch * (k as f64 / columns).floor() - 25.0);
            Item { kind: k % 5, x, y, r: 0.3 * pitch, metal: k % 3 != 0 }
        })
        .collect()
}

/// The yard as a scene.
pub fn yard(solids: usize, side: usize) -> Option<SolidScene> {
    let mut text = format!(
        "kind = \"solids\"\nname = \"yard\"\n[camera]\nposition_m = [0, -60, 30]\nlook_at_m = [0, 0, 0]\nfov_deg = 50\nsize_px = [{side}, {side}]\n\
         [surface.metal]\nlayer = [{{ material = \"steel\" }}]\n[surface.soil]\nlayer = [{{ material = \"soil\" }}]\n\
         [surface.concrete]\nlayer = [{{ material = \"concrete\" }}]\n[ground]\nsurface = \"soil\"\n"
    );
    for (k, Item { kind, x, y, r, metal }) in items(solids).into_iter().enumerate() {
        let (kind, data) = match kind {
            0 => ("SPH", format!("{x}, {y}, {r}, {r}")),
            1 => ("RPP", format!("{}, {}, {}, {}, 0, {}", x - r, x + r, y - r, y + r, 2.0 * r)),
            2 => ("RCC", format!("{x}, {y}, 0, 0, 0, {}, {r}", 3.0 * r)),
            3 => ("TRC", format!("{x}, {y}, 0, 0, 0, {}, {r}, {}", 2.5 * r, 0.3 * r)),
            _ => ("ELL", format!("{x}, {y}, {r}, {x}, {y}, {}, {}", 2.0 * r, 2.5 * r)),
        };
        let surface = if metal { "metal" } else { "concrete" };
        let _ = writeln!(text, "[[body]]\nname = \"b{k}\"\ntype = \"{kind}\"\ndata = [{data}]\nsurface = \"{surface}\"");
    }
    SolidScene::from_toml(&text).ok()
}

/// The same solids for POV-Ray. Every surface is a mirror that emits light, and there is no shading.
pub fn pov(solids: usize) -> String {
    let mut text = String::from(
        "#version 3.7;\nglobal_settings { assumed_gamma 1 max_trace_level 9 adc_bailout 0.001 }\n\
         camera { location <0, -60, 30> sky z up y right x angle 50 look_at 0 }\n\
         background { rgb 0.2 }\n\
         #declare Metal = texture { pigment { rgb 0.1 } finish { ambient 0.1 diffuse 0 reflection 0.95 } }\n\
         #declare Stone = texture { pigment { rgb 0.8 } finish { ambient 0.7 diffuse 0 reflection 0.2 } }\n\
         plane { z, 0 texture { Stone } }\n",
    );
    for Item { kind, x, y, r, metal } in items(solids) {
        let shape = match kind {
            0 => format!("sphere {{ <{x}, {y}, {r}>, {r}"),
            1 => format!("box {{ <{}, {}, 0>, <{}, {}, {}>", x - r, y - r, x + r, y + r, 2.0 * r),
            2 => format!("cylinder {{ <{x}, {y}, 0>, <{x}, {y}, {}>, {r}", 3.0 * r),
            3 => format!("cone {{ <{x}, {y}, 0>, {r}, <{x}, {y}, {}>, {}", 2.5 * r, 0.3 * r),
            _ => {
                let (major, minor) = (1.25 * r, (1.25_f64.powi(2) - 0.25).sqrt() * r);
                format!("sphere {{ 0, 1 scale <{minor}, {minor}, {major}> translate <{x}, {y}, {}>", 1.5 * r)
            }
        };
        let _ = writeln!(text, "{shape} texture {{ {} }} }}", if metal { "Metal" } else { "Stone" });
    }
    text
}

/// Processor time in s that this process, or the processes for which it waited, have used so far; `None` if the system does not report it.
pub fn cpu_s(children: bool) -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The name in brackets may hold spaces; user and system time are fields 14 and 15, those of children 16 and 17, in 1/100 s.
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let first = if children { 13 } else { 11 };
    Some((fields.get(first)?.parse::<f64>().ok()? + fields.get(first + 1)?.parse::<f64>().ok()?) / 100.0)
}
