//! One page's connection.

use std::sync::Arc;

use axum::extract::ws::{CloseFrame, Message, WebSocket, close_code};
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt, StreamExt};

use crate::desk::{Letter, Outbox, Page};
use crate::protocol::{Answer, Ask};
use crate::shared::Shared;
use crate::thresholds::MOST_PANES;

/// Serves a page until it leaves, breaks the rules, or the server stops.
pub(crate) async fn serve(mut socket: WebSocket, shared: Arc<Shared>) {
    let Some((page, outbox)) = shared.desk.open(shared.most_pages) else {
        let reason = format!("{} pages are open, and no more may be", shared.most_pages);
        close(&mut socket, close_code::AGAIN, &reason).await;
        return;
    };
    let (mut sink, mut stream) = socket.split();
    let mut stop = shared.stop.clone();
    let why = tokio::select! {
        () = send(&mut sink, &shared, &outbox) => None,
        why = receive(&mut stream, &shared, (page, &*outbox)) => why,
        _ = stop.wait_for(|stopped| *stopped) => Some((close_code::AWAY, "the server stops".to_owned())),
    };
    if shared.desk.leave(page) {
        shared.exhibit.pause(false);
    }
    if let Some((code, reason)) = why {
        close(&mut sink, code, &reason).await;
    }
}

/// Says farewell; the page may be gone already.
async fn close(sink: &mut (impl SinkExt<Message> + Unpin), code: u16, reason: &str) {
    // A reason has at most 123 bytes.
    let reason: String = reason.chars().take(100).filter(char::is_ascii).collect();
    let _ = sink.send(Message::Close(Some(CloseFrame { code, reason: reason.into() }))).await;
}

/// Sends the greeting and what comes into the outbox, until the page is gone.
async fn send(sink: &mut SplitSink<WebSocket, Message>, shared: &Shared, outbox: &Outbox) {
    let mut message = Message::Text(hello(shared).into());
    while sink.send(message).await.is_ok() {
        message = match outbox.next().await {
            Letter::Frame(bytes) => Message::Binary(bytes.into()),
            Letter::Answer(text) => Message::Text(text.into()),
        };
        shared.desk.sent();
    }
}

/// Takes requests until the page leaves; returns why it is sent away, if it is.
async fn receive(
    stream: &mut SplitStream<WebSocket>,
    shared: &Shared,
    (page, outbox): (Page, &Outbox),
) -> Option<(u16, String)> {
    while let Some(message) = stream.next().await {
        match message {
            Ok(Message::Text(text)) => match parse(&text) {
                Ok(ask) => take(ask, shared, (page, outbox)),
                Err(reason) => return Some((close_code::POLICY, reason)),
            },
            Ok(Message::Binary(_)) => {
                return Some((close_code::UNSUPPORTED, "requests are JSON text".to_owned()));
            }
            Ok(Message::Ping(_) | Message::Pong(_)) => {}
            Ok(Message::Close(_)) | Err(_) => return None,
        }
    }
    None
}

/// Answers at once what needs no drawing, and lays all else on the desk.
fn take(ask: Ask, shared: &Shared, (page, outbox): (Page, &Outbox)) {
    match ask {
        Ask::Hello => outbox.text(hello(shared)),
        Ask::Training => {
            if let Some(sheet) = shared.exhibit.sheet() {
                outbox.answer(&Answer::Training(sheet));
            }
        }
        Ask::Pause { paused } => shared.exhibit.pause(paused),
        ask => shared.desk.ask(page, ask),
    }
}

/// What there is to see.
fn hello(shared: &Shared) -> String {
    let hello = shared.exhibit.current().0.hello(shared.exhibit.is_training());
    serde_json::to_string(&hello).unwrap_or_default()
}

fn parse(text: &str) -> Result<Ask, String> {
    let ask: Ask = serde_json::from_str(text).map_err(|error| format!("not a request: {error}"))?;
    match &ask {
        Ask::Frame(view) | Ask::Pick { view, .. } | Ask::Slice { view, .. } if view.pane >= MOST_PANES => {
            Err(format!("pane {} of at most {MOST_PANES}", view.pane))
        }
        _ => Ok(ask),
    }
}
