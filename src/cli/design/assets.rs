//! The page, as Vite built it from the sources in `page`. `make page` builds it anew.

/// A file of the page.
pub(super) struct Asset {
    pub(super) name: &'static str,
    pub(super) kind: &'static str,
    pub(super) bytes: &'static [u8],
}

/// All files of the page.
pub(super) const ASSETS: [Asset; 5] = [
    Asset { name: "", kind: "text/html; charset=utf-8", bytes: include_bytes!("page/dist/index.html") },
    Asset { name: "page.js", kind: "text/javascript; charset=utf-8", bytes: include_bytes!("page/dist/page.js") },
    Asset { name: "page.css", kind: "text/css; charset=utf-8", bytes: include_bytes!("page/dist/page.css") },
    Asset { name: "icon.svg", kind: "image/svg+xml", bytes: include_bytes!("page/dist/icon.svg") },
    Asset { name: "licences.txt", kind: "text/plain; charset=utf-8", bytes: include_bytes!("page/dist/licences.txt") },
];

/// The file of that name.
pub(super) fn asset(name: &str) -> Option<&'static Asset> {
    ASSETS.iter().find(|a| a.name == name)
}
