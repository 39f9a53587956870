//! Answers the browser: the files of the page, and the WebSocket of each open page. The server listens on this computer only.

use std::net::TcpListener;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::time::Duration;

use axum::Router;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::extract::{Path, Request as HttpRequest, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::{any, get};
use tokio::sync::mpsc::{Sender, channel};

use super::request::{LONGEST, PageRequest};
use super::worker::{ToPage, WorkerMessage, problem_message};

/// Most pages that are open at once.
const MOST_PAGES: usize = 16;

/// Messages that wait for a page, and for the worker.
const WAITING: usize = 64;

/// Time between two looks at the stop flag.
const LOOK: Duration = Duration::from_millis(100);

/// The rights of the page: it may run its own files and speak with the program that sent it.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Name, type and text of the files of the page.
const FILES: [(&str, &str, &str); 14] = [
    ("", "text/html; charset=utf-8", include_str!("page/page.html")),
    ("page.css", "text/css; charset=utf-8", include_str!("page/page.css")),
    ("icon.svg", "image/svg+xml", include_str!("page/icon.svg")),
    ("main.js", SCRIPT, include_str!("page/main.js")),
    ("link.js", SCRIPT, include_str!("page/link.js")),
    ("picture.js", SCRIPT, include_str!("page/picture.js")),
    ("camera.js", SCRIPT, include_str!("page/camera.js")),
    ("timeline.js", SCRIPT, include_str!("page/timeline.js")),
    ("curves.js", SCRIPT, include_str!("page/curves.js")),
    ("panels.js", SCRIPT, include_str!("page/panels.js")),
    ("bar.js", SCRIPT, include_str!("page/bar.js")),
    ("marks.js", SCRIPT, include_str!("page/marks.js")),
    ("objects.js", SCRIPT, include_str!("page/objects.js")),
    ("save.js", SCRIPT, include_str!("page/save.js")),
];
const SCRIPT: &str = "text/javascript; charset=utf-8";

#[derive(Clone)]
struct HttpState {
    commands: Sender<WorkerMessage>,
    next: Arc<AtomicU64>,
    open: Arc<AtomicUsize>,
}

/// Serves pages until `stop` is set or the worker has ended.
///
/// # Errors
/// The listener can not be used.
pub(crate) async fn serve(
    listener: TcpListener,
    commands: Sender<WorkerMessage>,
    stop: Arc<AtomicBool>,
) -> std::io::Result<()> {
    listener.set_nonblocking(true)?;
    let listener = tokio::net::TcpListener::from_std(listener)?;
    let worker = commands.clone();
    let shared = HttpState { commands, next: Arc::default(), open: Arc::default() };
    let router = Router::new()
        .route("/", get(|| async { file("") }))
        .route("/stream", any(stream))
        .route("/{name}", get(|Path(name): Path<String>| async move { file(&name) }))
        .layer(middleware::from_fn(guard))
        .with_state(shared);
    let ended = async {
        while !stop.load(Ordering::Relaxed) && !worker.is_closed() {
            tokio::time::sleep(LOOK).await;
        }
    };
    tokio::select! {
        served = axum::serve(listener, router) => served,
        () = ended => Ok(()),
    }
}

/// Refuses requests of other sites' pages through this browser, and adds the page's rules.
async fn guard(request: HttpRequest, next: Next) -> Response {
    if !is_from_here(request.headers()) {
        return (StatusCode::FORBIDDEN, "only pages of this program may ask").into_response();
    }
    let mut response = next.run(request).await;
    let headers = response.headers_mut();
    for (name, value) in [
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::CACHE_CONTROL, "no-store"),
    ] {
        headers.insert(name, header::HeaderValue::from_static(value));
    }
    response
}

/// Whether a request names this computer as its host, once, and comes from a page of the same address where it comes from one. Bytes that are no text
/// are another origin.
fn is_from_here(headers: &HeaderMap) -> bool {
    let mut hosts = headers.get_all(header::HOST).iter();
    let (Some(host), None) = (hosts.next().and_then(|host| host.to_str().ok()), hosts.next()) else { return false };
    let name = host.rsplit_once(':').map_or(host, |(name, _)| name);
    let here = ["127.0.0.1", "localhost", "[::1]"].contains(&name);
    let page = format!("http://{host}");
    here && headers.get_all(header::ORIGIN).iter().all(|origin| origin.as_bytes() == page.as_bytes())
}

fn file(name: &str) -> Response {
    match FILES.iter().find(|(known, ..)| *known == name) {
        Some((_, kind, text)) => ([(header::CONTENT_TYPE, *kind)], *text).into_response(),
        None => (StatusCode::NOT_FOUND, "there is no such file").into_response(),
    }
}

async fn stream(State(shared): State<HttpState>, upgrade: WebSocketUpgrade) -> Response {
    if shared.open.load(Ordering::Relaxed) >= MOST_PAGES {
        return (StatusCode::SERVICE_UNAVAILABLE, "too many pages are open").into_response();
    }
    let bounded = upgrade.max_message_size(LONGEST).max_frame_size(LONGEST);
    bounded.on_upgrade(move |socket| async move {
        shared.open.fetch_add(1, Ordering::Relaxed);
        talk(socket, &shared).await;
        shared.open.fetch_sub(1, Ordering::Relaxed);
    })
}

/// Carries messages between a page and the worker until one of them has ended.
async fn talk(mut socket: WebSocket, shared: &HttpState) {
    let id = shared.next.fetch_add(1, Ordering::Relaxed);
    let (page, mut messages) = channel(WAITING);
    if shared.commands.send(WorkerMessage::Join { id, page }).await.is_err() {
        return;
    }
    loop {
        tokio::select! {
            message = messages.recv() => {
                let sent = match message {
                    Some(ToPage::Text(text)) => socket.send(Message::text(text)).await,
                    Some(ToPage::Image(bytes)) => socket.send(Message::binary(bytes)).await,
                    None => break,
                };
                if sent.is_err() {
                    break;
                }
            }
            message = socket.recv() => {
                let request = match message {
                    Some(Ok(Message::Text(text))) => PageRequest::read(&text),
                    Some(Ok(Message::Binary(_))) => Err("the message is not understood: it is no text".to_owned()),
                    Some(Ok(Message::Ping(_) | Message::Pong(_))) => continue,
                    Some(Ok(Message::Close(_)) | Err(_)) | None => break,
                };
                let went = match request {
                    Ok(request) => shared.commands.send(WorkerMessage::Ask(id, request)).await.is_ok(),
                    Err(problem) => socket.send(Message::text(problem_message(&problem))).await.is_ok(),
                };
                if !went {
                    break;
                }
            }
        }
    }
    let _ = shared.commands.send(WorkerMessage::Leave(id)).await;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_pages_of_this_program_may_ask() {
        let from = |pairs: &[(header::HeaderName, &str)]| {
            let all = pairs.iter().map(|(name, value)| (name.clone(), value.parse().unwrap()));
            is_from_here(&all.collect())
        };
        let host = header::HOST;
        assert!(from(&[(host.clone(), "127.0.0.1:8000")]));
        assert!(from(&[(host.clone(), "localhost:8000"), (header::ORIGIN, "http://localhost:8000")]));
        assert!(from(&[(host.clone(), "[::1]:8000")]));
        assert!(!from(&[]));
        assert!(!from(&[(host.clone(), "evil.example:8000")]));
        assert!(!from(&[(host.clone(), "127.0.0.1.evil.example")]));
        assert!(!from(&[(host.clone(), "127.0.0.1:8000"), (header::ORIGIN, "http://evil.example")]));
        assert!(!from(&[(host.clone(), "127.0.0.1:8000"), (header::ORIGIN, "http://127.0.0.1:9000")]));
        let mut headers: HeaderMap = [(host.clone(), "127.0.0.1:8000".parse().unwrap())].into_iter().collect();
        assert!(is_from_here(&headers));
        // An origin that is no text, an empty one, and a second one.
        for origin in [&b"http://\xff.example"[..], b"\x80", b""] {
            headers.insert(header::ORIGIN, header::HeaderValue::from_bytes(origin).unwrap());
            assert!(!is_from_here(&headers), "{origin:?}");
        }
        headers.insert(header::ORIGIN, "http://127.0.0.1:8000".parse().unwrap());
        assert!(is_from_here(&headers));
        headers.append(header::ORIGIN, "http://evil.example".parse().unwrap());
        assert!(!is_from_here(&headers));
        headers.remove(header::ORIGIN);
        headers.append(host, "evil.example".parse().unwrap());
        assert!(!is_from_here(&headers));
    }
}
