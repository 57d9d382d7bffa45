//! Compiles the shim over casacore's tables, where the feature `ms` asks for it.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    #[cfg(feature = "ms")]
    casacore();
}

#[cfg(feature = "ms")]
fn casacore() {
    let folder = "src/ms/casacore";
    println!("cargo:rerun-if-changed={folder}");
    // Only the headers' place is asked for: linking all fifteen libraries of casacore would drag in FFTW, WCSLIB and Python.
    let found = pkg_config::Config::new().cargo_metadata(false).atleast_version("3.0").probe("casacore");
    let includes = match found {
        Ok(library) => library.include_paths,
        Err(e) => {
            println!("cargo:warning=casacore was not found ({e}); the feature `ms` needs it: apt-get install casacore-dev");
            std::process::exit(1);
        }
    };
    cc::Build::new()
        .cpp(true)
        .std("c++17")
        .warnings(true)
        .flag_if_supported("-Wno-unused-parameter")
        // Warnings about the headers of casacore are switched off, because they are not part of this project. The folder of the compiler
        // must keep its place in the search order.
        .flags(includes.iter().filter(|p| p.as_os_str() != "/usr/include").map(|p| format!("-isystem{}", p.display())))
        .file(format!("{folder}/table.cc"))
        .file(format!("{folder}/keywords.cc"))
        .file(format!("{folder}/probe.cc"))
        .compile("cittert_casacore");
    println!("cargo:rustc-link-lib=casa_tables");
    println!("cargo:rustc-link-lib=casa_casa");
}
