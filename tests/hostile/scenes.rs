//! Every command that reads an impossible scene gives one message with the line.

use crate::program::Scratch;

const TANK: &str = r#"kind = "solids"
name = "tank"
[camera]
position_m = [0, -30, 4]
look_at_m = [0, 0, 1]
size_px = [8, 8]
[surface.steel]
layer = [{ material = "steel" }]
[surface.soil]
layer = [{ material = "soil" }]
[ground]
surface = "soil"
[[body]]
name = "hull"
type = "BOX"
data = [-3, -1, 0.4, 6, 0, 0, 0, 2, 0, 0, 0, 1]
[[body]]
name = "dome"
type = "SPH"
data = [0, 0, 1.4, 0.8]
[[region]]
name = "all"
is = "+hull OR +dome"
surface = "steel"
"#;

#[test]
fn every_bad_scene_has_one_message_with_its_line() {
    let s = Scratch::new();
    s.write("rays.csv", "ox,oy,oz,dx,dy,dz\n0,-30,4,0,1,-0.1\n");
    for (from, to, words) in [
        ("+hull OR +dome", "+hull OR +dorm", ["line 21", "unknown body `dorm`"]),
        ("0, 2, 0, 0, 0, 1]", "0, 0, 0, 0, 0, 1]", ["line 13", "BOX is singular"]),
        ("0, 2, 0, 0, 0, 1]", "1, 2, 0, 0, 0, 1]", ["line 13", "perpendicular"]),
        ("1.4, 0.8]", "1.4, 0]", ["line 17", "radius R of the SPH is 0 m"]),
        ("\"+hull OR +dome\"", "\"\"", ["line 21", "names no body"]),
        ("[0, -30, 4]", "[0, 0.1, 1]", ["line 3", "inside region `all`"]),
        ("[0, -30, 4]", "[0, 0, 1]", ["line 3", "away from the camera"]),
        ("[0, -30, 4]", "[0, -30, -1]", ["line 3", "under the ground"]),
        ("\nsurface = \"steel\"\n", "\n", ["line 21", "has no material"]),
        ("material = \"steel\"", "material = \"stele\"", ["line 8", "unknown material `stele`"]),
        ("type = \"SPH\"", "type = \"SPHERE\"", ["line 17", "unknown body type `SPHERE`"]),
        ("is = \"", "was = \"", ["line 23", "unknown field `was`"]),
        ("0.8]", "nan]", ["line 17", "parameter 4 of the SPH is NaN"]),
    ] {
        assert!(TANK.contains(from), "{from}");
        s.write("bad.toml", TANK.replacen(from, to, 1));
        s.fails("scene render bad.toml -o x.fits", 1, &["bad.toml", words[0], words[1]]);
        s.fails("scene probe bad.toml --rays rays.csv", 1, &["bad.toml", words[0], words[1]]);
        s.fails("scene convert bad.toml x.txt", 1, &["bad.toml", words[0], words[1]]);
    }
    s.write("empty.toml", "kind = \"solids\"\nname = \"nothing\"\n");
    s.fails("scene render empty.toml -o x.fits", 1, &["empty.toml", "the scene is empty"]);
    let sim = "simulate --layout mm-ring --freq 94GHz --bandwidth 1GHz --channels 1 -o x.uvh5 --scene";
    s.fails(&format!("{sim} empty.toml"), 1, &["empty.toml", "the scene is empty"]);
    assert_eq!(s.names(), ["bad.toml", "empty.toml", "rays.csv"]);
}

#[test]
fn every_bad_text_has_one_message_with_its_line() {
    let s = Scratch::new();
    s.write("rays.csv", "ox,oy,oz,dx,dy,dz\n0,0,9,0,0,-1\n");
    for (text, words) in [
        ("1 SPH 0 0 0 1\nREGION a ; +2 ; steel\n", ["line 2", "unknown body `2`"]),
        ("1 SPH 0 0 0 0\nREGION a ; +1 ; steel\n", ["line 1", "radius R"]),
        ("1 BOX 0 0 0 1 0 0 0 0 0 0 0 1\nREGION a ; +1\n", ["line 1", "singular"]),
        ("1 SPH 0 0 0 1\nREGION a ; ; steel\n", ["line 2", "names no body"]),
        ("1 SPH 0 0 0\nREGION a ; +1\n", ["line 1", "4"]),
        ("1 SPH 0 0 0 1\nREGION a ; -1\n", ["line 2", "a"]),
        ("1 SPH 0 0 0 1\n1 SPH 0 0 0 2\nREGION a ; +1\n", ["line 2", "already given at line 1"]),
    ] {
        s.write("bad.txt", text);
        s.fails("scene probe bad.txt --rays rays.csv", 1, &["bad.txt", words[0], words[1]]);
        s.fails("scene convert bad.txt x.toml", 1, &["bad.txt", words[0], words[1]]);
    }
}

#[test]
fn cameras_without_a_scene_and_options_out_of_range() {
    let s = Scratch::new();
    s.write("ok.toml", TANK);
    s.fails("scene render ok.toml --antialias 0 -o x.fits", 1, &["antialias is 0", "1 to 16"]);
    s.fails("scene render ok.toml --max-bounces 5000 -o x.fits", 1, &["max_bounces is 5000"]);
    s.fails("scene render ok.toml --mode realtime --step 3 -o x.fits", 1, &["step of the mesh is 3", "1, 2, 4, 8, 16 or 32"]);
    s.fails("scene render ok.toml --scene-cell 1mrad -o x.fits", 2, &["--scene-size"]);
    s.fails("scene render ok.toml --pol RR -o x.fits", 1, &["RR", "one of I, Q, U, V"]);
    s.fails("scene render ok.toml --channels 0 -o x.fits", 1, &["channel"]);
    s.fails("scene render ok.toml --scene-size 1000000 -o x.fits", 1, &["1000000"]);
    s.fails("scene render ok.toml --isothermal 5 -o x.fits", 2, &["no unit"]);
    s.write("blind.toml", TANK.replace("[camera]\nposition_m = [0, -30, 4]\nlook_at_m = [0, 0, 1]\nsize_px = [8, 8]\n", ""));
    s.fails("scene render blind.toml -o x.fits", 1, &["blind.toml", "[camera]", "missing"]);
    s.write("path.toml", "frames_per_second = 0\nkey = []\n");
    s.fails("scene fly path.toml --scene ok.toml -o d", 1, &["path.toml", "[[key]]"]);
}
