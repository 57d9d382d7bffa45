//! The page of `cittert design`: what was built fits its sources, and its packages are pinned and their licences listed. This needs no Node.

use serde_json::Value;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src/cli/design/page")
}

fn read(name: &str) -> Vec<u8> {
    std::fs::read(folder().join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn json(name: &str) -> Value {
    serde_json::from_slice(&read(name)).unwrap()
}

/// FNV-1a of 64 bits.
fn hash(bytes: &[u8]) -> String {
    let h = bytes.iter().fold(0xcbf2_9ce4_8422_2325_u64, |h, b| (h ^ u64::from(*b)).wrapping_mul(0x100_0000_01b3));
    format!("{h:016x}")
}

#[test]
fn the_hash_is_that_of_the_build() {
    // From the table of test vectors of Fowler, Noll and Vo.
    assert_eq!(hash(b""), "cbf29ce484222325");
    assert_eq!(hash(b"foobar"), "85944171f73967e8");
}

#[test]
fn the_page_was_built_from_its_sources() {
    let text = String::from_utf8(read("dist/hashes.txt")).unwrap();
    let listed: Vec<(&str, &str)> = text.lines().map(|l| l.split_once("  ").unwrap()).collect();
    for (was, name) in &listed {
        assert_eq!(*was, hash(&read(name)), "{name} was changed since the page was built: run `make page`");
    }
    let names: BTreeSet<String> = listed.iter().map(|(_, name)| (*name).to_owned()).collect();
    let files = |below: &str| {
        let all = std::fs::read_dir(folder().join(below)).unwrap().map(|e| e.unwrap());
        let all = all.filter(|e| e.file_type().unwrap().is_file()).map(|e| e.file_name().into_string().unwrap());
        all.map(|n| format!("{below}{n}")).collect::<Vec<_>>()
    };
    let all = ["src/", "public/", "dist/", ""].into_iter().flat_map(files);
    let present: BTreeSet<String> = all.filter(|n| n != "dist/hashes.txt" && n != ".gitignore").collect();
    assert_eq!(names, present, "a file was added or removed since the page was built: run `make page`");
}

#[test]
fn the_page_is_small_and_asks_nobody() {
    let total: usize = ["index.html", "page.js", "page.css"].map(|n| read(&format!("dist/{n}")).len()).iter().sum();
    assert!(total > 50_000 && total < 1_000_000, "{total} bytes");
    let page = String::from_utf8(read("dist/index.html")).unwrap();
    // The policy of the server allows no script or style within the page.
    assert!(!page.contains("<style") && !page.contains("style=") && !page.contains("https://") && !page.contains("http://"));
    assert!(
        page.match_indices("<script")
            .all(|(at, _)| page[at..].split_once('>').is_some_and(|(tag, rest)| tag.contains("src=") && rest.starts_with("</script>")))
    );
    let script = String::from_utf8(read("dist/page.js")).unwrap();
    assert!(!script.contains("eval(") && !script.contains("new Function"));
}

#[test]
fn its_packages_are_pinned_and_their_licences_listed() {
    let (package, lock) = (json("package.json"), json("package-lock.json"));
    let licences = String::from_utf8(read("dist/licences.txt")).unwrap();
    for kind in ["dependencies", "devDependencies"] {
        for (name, version) in package[kind].as_object().unwrap() {
            let version = version.as_str().unwrap();
            assert!(version.starts_with(|c: char| c.is_ascii_digit()), "{name} {version} is no exact version");
            let locked = &lock["packages"][format!("node_modules/{name}")];
            assert_eq!(locked["version"], *version, "{name}: package-lock.json has another version");
            assert!(locked["integrity"].as_str().is_some_and(|i| i.starts_with("sha512-")), "{name} has no checksum");
        }
    }
    let used: Vec<(&String, &Value)> =
        lock["packages"].as_object().unwrap().iter().filter(|(path, of)| !path.is_empty() && of["dev"] != true).collect();
    let used: Vec<_> = used.into_iter().filter(|(_, of)| of["optional"] != true).collect();
    assert!(used.len() >= package["dependencies"].as_object().unwrap().len());
    for (path, of) in used {
        let (name, version, licence) =
            (path.trim_start_matches("node_modules/"), of["version"].as_str().unwrap(), of["license"].as_str().unwrap());
        assert!(["MIT", "ISC"].contains(&licence), "{name} has the licence {licence}");
        assert!(licences.contains(&format!("\n{name} {version} ({licence})\n")), "dist/licences.txt lacks {name} {version}");
    }
}
