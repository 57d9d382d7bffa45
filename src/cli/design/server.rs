//! The server: the files of the page, and a socket for each tab.

use super::assets::asset;
use super::beginning::Beginning;
use super::frame::{Answer, Send};
use super::guard::{Guard, Refused};
use super::message::{MOST_BYTES, Sent};
use super::session::Session;
use crate::cli::failure::{Context as _, Result};
use axum::Router;
use axum::body::Body;
use axum::extract::ws::rejection::WebSocketUpgradeRejection;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::extract::{Path, State};
use axum::http::{HeaderMap, Response, StatusCode, header};
use axum::response::IntoResponse;
use axum::routing::{any, get};
use axum::serve::ListenerExt;
use std::net::TcpListener;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use tokio::sync::mpsc;

/// Most tabs at a time.
const MOST_TABS: usize = 8;
/// Answers that wait for a slow tab before its worker waits too.
const WAITING: usize = 32;
/// Room for the header of a dropped file.
const HEADER: usize = 8192;

const TEXT: &str = "text/plain; charset=utf-8";

/// The page may load its own files and open its own socket, and nothing else.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src 'self'; base-uri 'none'; \
                      form-action 'none'; frame-ancestors 'none'";

/// A page that is ready to be served.
pub(super) struct Served {
    listener: TcpListener,
    port: u16,
    shared: Arc<Shared>,
}

struct Shared {
    guard: Guard,
    port: u16,
    beginning: Beginning,
    folder: std::path::PathBuf,
    tabs: AtomicUsize,
}

impl Served {
    /// Serve on this listener.
    ///
    /// # Errors
    /// The listener has no port.
    pub(super) fn new(listener: TcpListener, guard: Guard, beginning: Beginning) -> Result<Self> {
        let port = listener.local_addr().context("the port")?.port();
        listener.set_nonblocking(true).context("the port")?;
        let folder = beginning.scenes.folder().to_path_buf();
        let shared = Shared { guard, port, beginning, folder, tabs: AtomicUsize::new(0) };
        Ok(Self { listener, port, shared: Arc::new(shared) })
    }

    /// The address of the page.
    pub(super) fn address(&self) -> String {
        format!("http://127.0.0.1:{}/{}/", self.port, self.shared.guard.token())
    }

    /// Serve until the program ends.
    ///
    /// # Errors
    /// The system gives no sockets.
    pub(super) fn run(self) -> Result<()> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_io().build().context("starting the server")?;
        runtime.block_on(async {
            let listener = tokio::net::TcpListener::from_std(self.listener).context("starting the server")?;
            let routes = Router::new()
                .route(
                    "/{token}/",
                    get(|s: State<Arc<Shared>>, Path(token): Path<String>, h: HeaderMap| async move { file(&s, &token, "", &h) }),
                )
                .route(
                    "/{token}/{name}",
                    get(|s: State<Arc<Shared>>, Path((token, name)): Path<(String, String)>, h: HeaderMap| async move {
                        file(&s, &token, &name, &h)
                    }),
                )
                .route("/{token}/socket", any(socket))
                .fallback(|| async { refused(Refused::Token) })
                .with_state(self.shared);
            // A short answer must not wait for the receipt of the one before it.
            let listener = listener.tap_io(|stream| drop(stream.set_nodelay(true)));
            axum::serve(listener, routes).await.context("serving the page")
        })
    }
}

fn text_of(headers: &HeaderMap, name: header::HeaderName) -> Option<&str> {
    headers.get(name).map(|v| v.to_str().unwrap_or("?"))
}

fn check(shared: &Shared, token: &str, headers: &HeaderMap, needs_origin: bool) -> std::result::Result<(), Refused> {
    let (host, origin) = (text_of(headers, header::HOST), text_of(headers, header::ORIGIN));
    shared.guard.check(shared.port, token, host, origin, needs_origin)
}

fn refused(why: Refused) -> Response<Body> {
    answer(StatusCode::FORBIDDEN, TEXT, why.text().as_bytes())
}

fn answer(status: StatusCode, kind: &str, bytes: &'static [u8]) -> Response<Body> {
    let headers = [
        (header::CONTENT_TYPE, kind),
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::CACHE_CONTROL, "no-store"),
        (header::HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
        (header::HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    ];
    (status, headers, bytes).into_response()
}

fn file(shared: &Shared, token: &str, name: &str, headers: &HeaderMap) -> Response<Body> {
    if let Err(why) = check(shared, token, headers, false) {
        return refused(why);
    }
    match asset(name) {
        Some(asset) => answer(StatusCode::OK, asset.kind, asset.bytes),
        None => answer(StatusCode::NOT_FOUND, TEXT, b"there is no such file"),
    }
}

async fn socket(
    State(shared): State<Arc<Shared>>,
    Path(token): Path<String>,
    headers: HeaderMap,
    upgrade: std::result::Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Response<Body> {
    if let Err(why) = check(&shared, &token, &headers, true) {
        return refused(why);
    }
    let Ok(upgrade) = upgrade else { return answer(StatusCode::BAD_REQUEST, TEXT, b"this address is a WebSocket") };
    let most = MOST_BYTES + HEADER;
    upgrade.max_message_size(most).max_frame_size(most).on_upgrade(move |socket| tab(shared, socket))
}

/// Counts a tab while it is open.
struct Counted<'a>(&'a AtomicUsize);

impl Drop for Counted<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Serve a tab until it is closed. The tab has a thread of its own that answers its messages one after another, so that a long answer keeps no
/// other tab waiting. A tab that sends faster than it is answered is not read until there is room, so nothing is lost and nothing grows.
async fn tab(shared: Arc<Shared>, mut socket: WebSocket) {
    let open = shared.tabs.fetch_add(1, Ordering::Relaxed);
    let _counted = Counted(&shared.tabs);
    if open >= MOST_TABS {
        let text = format!(r#"{{"is":"error","text":"{MOST_TABS} tabs are open already: close one, and load this one again"}}"#);
        let _ = socket.send(Message::Text(text.into())).await;
        return;
    }
    let (sender, mut answers) = mpsc::channel(WAITING);
    let (messages, mut arrived) = mpsc::channel(1);
    let send: Send = Arc::new(move |answer| sender.blocking_send(answer).is_ok());
    let own = shared.clone();
    let work = move || {
        if let Some(mut session) = Session::begin(&own.beginning, own.folder.clone(), send) {
            while let Some(sent) = arrived.blocking_recv() {
                session.answer(&sent);
            }
        }
    };
    if std::thread::Builder::new().name("tab".into()).spawn(work).is_err() {
        return;
    }
    loop {
        tokio::select! {
            answer = answers.recv() => {
                let message = match answer {
                    Some(Answer::Text(text)) => Message::Text(text.into()),
                    Some(Answer::Binary(bytes)) => Message::Binary(bytes.into()),
                    None => return,
                };
                if socket.send(message).await.is_err() {
                    return;
                }
            }
            (room, message) = async { (messages.reserve().await, socket.recv().await) } => {
                let Ok(room) = room else { return };
                match message {
                    Some(Ok(Message::Text(text))) => room.send(Sent::Text(text.as_str().to_owned())),
                    Some(Ok(Message::Binary(bytes))) => room.send(Sent::File(bytes.into())),
                    Some(Ok(Message::Close(_)) | Err(_)) | None => return,
                    Some(Ok(_)) => {}
                }
            }
        }
    }
}
