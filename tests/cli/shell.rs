//! Completion scripts and manual pages.

use crate::program::Scratch;

#[test]
fn completions_name_the_subcommands_of_every_shell() {
    let s = Scratch::new();
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let script = s.ok(&format!("completions {shell}")).out;
        for word in ["selfcal", "permittivity", "overwrite"] {
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
    assert_eq!(s.json("completions zsh")["shell"], "zsh");
    s.fails("completions csh", 2, &["csh", "bash, elvish, fish, powershell, zsh"]);
}

#[test]
fn every_subcommand_has_a_manual_page() {
    let s = Scratch::new();
    s.ok("man -o pages");
    for command in cittert::cli::command().get_subcommands() {
        assert!(s.path(&format!("pages/cittert-{}.1", command.get_name())).is_file(), "{}", command.get_name());
    }
    assert!(s.path("pages/cittert.1").is_file() && s.path("pages/cittert-layout-show.1").is_file());
    let page = std::fs::read_to_string(s.path("pages/cittert-scene-sky.1")).unwrap();
    assert!(page.contains("zenith") && page.contains("cittert scene sky"), "{page}");
    s.write("pages/cittert.1", "mine");
    s.fails("man -o pages", 1, &["exists already", "--overwrite"]);
    assert_eq!(std::fs::read_to_string(s.path("pages/cittert.1")).unwrap(), "mine");
    s.ok("man -o pages --overwrite");
}
