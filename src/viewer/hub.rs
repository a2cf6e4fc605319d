//! Where pages and the engine meet: for each page one request in work, one frame on the wire, and the newest request.
//!
//! One thread owns the engine and takes messages; a thread per page reads, another writes. Nothing here grows with the
//! time that a page is open or with what it sends.

use super::message::{Frame, LookRequest, Message};
use super::pace::Line;
use super::views::Views;
use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Maximum number of open pages.
const CLIENTS_MAX: usize = 8;
/// Maximum number of waiting requests other than frames.
const TASKS_MAX: usize = 64;
/// Maximum number of answers waiting for a page.
const REPLIES_MAX: usize = 64;

/// Number of a page.
pub(super) type ClientId = u64;

/// The next message of a writer.
#[derive(Debug)]
pub(super) enum Outgoing {
    Text(Arc<str>),
    Frame(Vec<u8>),
    Close,
}

#[derive(Debug, Default)]
struct Client {
    /// The newest request.
    pending: Option<LookRequest>,
    /// The request in work.
    is_in_work: bool,
    /// A frame that waits for the one on the wire.
    ready: Option<(u32, Vec<u8>)>,
    /// A frame that the writer has not taken yet.
    next: Option<Vec<u8>>,
    /// Number, bytes and time of the frame on the wire.
    on_wire: Option<(u32, usize, Instant)>,
    line: Line,
    replies: VecDeque<Arc<str>>,
    /// Version of each topic that was sent.
    sent: BTreeMap<&'static str, u64>,
    is_gone: bool,
}

#[derive(Debug, Default)]
struct State {
    clients: BTreeMap<ClientId, Client>,
    newest: ClientId,
    /// The page that had the last frame.
    served: ClientId,
    tasks: VecDeque<(ClientId, Message)>,
    /// The newest text of each topic, for every page.
    topics: BTreeMap<&'static str, (u64, Arc<str>)>,
    version: u64,
    views: Arc<Views>,
    /// Files that pages may fetch.
    files: Vec<PathBuf>,
    /// Where models go that pages send; none in a training.
    folder: Option<PathBuf>,
    /// Images of labels, as PNG.
    portraits: BTreeMap<u32, Arc<[u8]>>,
    is_closing: bool,
}

/// The meeting place.
#[derive(Debug, Default)]
pub(super) struct Hub {
    state: Mutex<State>,
    wake: Condvar,
}

impl Hub {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a page; none if there are too many.
    pub(super) fn join(&self) -> Option<ClientId> {
        let mut state = self.lock();
        if state.clients.len() >= CLIENTS_MAX || state.is_closing {
            return None;
        }
        state.newest += 1;
        let id = state.newest;
        state.clients.insert(id, Client::default());
        Some(id)
    }

    /// Removes a page and what it asked for.
    pub(super) fn leave(&self, id: ClientId) {
        let mut state = self.lock();
        state.clients.remove(&id);
        state.tasks.retain(|(client, _)| *client != id);
        self.wake.notify_all();
    }

    /// Takes a message of a page.
    pub(super) fn receive(&self, id: ClientId, message: Message) {
        let mut state = self.lock();
        let State { clients, tasks, .. } = &mut *state;
        let Some(client) = clients.get_mut(&id) else { return };
        match message {
            Message::Alive => {}
            Message::Look(look) => client.pending = Some(look),
            Message::Ack { seq } => {
                let Some((_, bytes, since)) = client.on_wire.take_if(|(own, ..)| *own == seq) else { return };
                client.line.note(bytes, since.elapsed());
                if let Some((seq, bytes)) = client.ready.take() {
                    client.put_on_wire(seq, bytes);
                }
            }
            other if tasks.len() < TASKS_MAX => tasks.push_back((id, other)),
            _ => client.reply(r#"{"kind":"problem","text":"Too many requests. Try again."}"#.into()),
        }
        self.wake.notify_all();
    }

    /// Takes a message of another thread of the server.
    pub(super) fn note(&self, message: Message) {
        self.lock().tasks.push_back((0, message));
        self.wake.notify_all();
    }

    /// Waits for work, at most `most`. Pages have turns; everything else comes before images.
    pub(super) fn next(&self, most: Duration) -> Option<(ClientId, Message)> {
        let end = Instant::now() + most;
        let mut state = self.lock();
        loop {
            if let Some(task) = state.tasks.pop_front() {
                return Some(task);
            }
            if let Some((id, look)) = state.next_look() {
                return Some((id, Message::Look(look)));
            }
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() || state.is_closing {
                return None;
            }
            state = self.wake.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Takes a request that is no frame, without waiting; one that needs a render only if `may_draw`.
    pub(super) fn next_message(&self, may_draw: bool) -> Option<(ClientId, Message)> {
        let tasks = &mut self.lock().tasks;
        let at = tasks.iter().position(|(_, message)| may_draw || !matches!(message, Message::Pick { .. }))?;
        tasks.remove(at)
    }

    /// Returns true if a page waits for a frame.
    pub(super) fn has_work(&self) -> bool {
        let state = self.lock();
        !state.tasks.is_empty() || state.clients.values().any(Client::waits)
    }

    pub(super) fn is_watched(&self) -> bool {
        !self.lock().clients.is_empty()
    }

    /// Returns true if the line to a page is slow for images of so many pixels, each in `target` seconds.
    pub(super) fn is_slow(&self, id: ClientId, pixels: f64, target: f64) -> bool {
        self.lock().clients.get_mut(&id).is_some_and(|client| client.line.is_slow(pixels, target))
    }

    /// Ends the work for a page's frame. It is sent at once, or when the one before has been drawn.
    pub(super) fn finish(&self, id: ClientId, frame: Option<&Frame>) {
        let encoded = frame.map(|frame| (frame.seq, frame.encode()));
        let mut state = self.lock();
        let Some(client) = state.clients.get_mut(&id) else { return };
        client.is_in_work = false;
        match encoded {
            Some((seq, bytes)) if client.on_wire.is_none() => client.put_on_wire(seq, bytes),
            Some(ready) => client.ready = Some(ready),
            None => {}
        }
        self.wake.notify_all();
    }

    pub(super) fn reply(&self, id: ClientId, value: &serde_json::Value) {
        if let Some(client) = self.lock().clients.get_mut(&id) {
            client.reply(value.to_string().into());
        }
        self.wake.notify_all();
    }

    /// Sends a message to all pages, including pages that connect later. Only the newest message of a topic counts.
    pub(super) fn publish(&self, topic: &'static str, value: &serde_json::Value) {
        let mut state = self.lock();
        let text: Arc<str> = value.to_string().into();
        if state.topics.get(topic).is_some_and(|(_, old)| *old == text) {
            return;
        }
        state.version += 1;
        let version = state.version;
        state.topics.insert(topic, (version, text));
        self.wake.notify_all();
    }

    /// Sets the views, whose photos pages may fetch.
    pub(super) fn set_views(&self, views: Arc<Views>) {
        self.lock().views = views;
    }

    pub(super) fn views(&self) -> Arc<Views> {
        Arc::clone(&self.lock().views)
    }

    /// Lets pages fetch a file. Returns its number.
    pub(super) fn add_file(&self, path: PathBuf) -> usize {
        let mut state = self.lock();
        state.files.push(path);
        state.files.len() - 1
    }

    pub(super) fn set_folder(&self, folder: PathBuf) {
        self.lock().folder = Some(folder);
    }

    pub(super) fn folder(&self) -> Option<PathBuf> {
        self.lock().folder.clone()
    }

    pub(super) fn set_portrait(&self, label: u32, png: Vec<u8>) {
        self.lock().portraits.insert(label, png.into());
    }

    pub(super) fn portrait(&self, label: u32) -> Option<Arc<[u8]>> {
        self.lock().portraits.get(&label).cloned()
    }

    pub(super) fn file(&self, number: usize) -> Option<PathBuf> {
        self.lock().files.get(number).cloned()
    }

    /// Waits for what a writer of a page sends next.
    pub(super) fn outgoing(&self, id: ClientId) -> Outgoing {
        let mut state = self.lock();
        loop {
            let State { clients, topics, is_closing, .. } = &mut *state;
            let Some(client) = clients.get_mut(&id).filter(|client| !client.is_gone) else { return Outgoing::Close };
            // Facts before the frames that they are about.
            for (topic, (version, text)) in topics {
                if client.sent.get(topic) != Some(version) {
                    client.sent.insert(topic, *version);
                    return Outgoing::Text(Arc::clone(text));
                }
            }
            if let Some(reply) = client.replies.pop_front() {
                return Outgoing::Text(reply);
            }
            if let Some(bytes) = client.next.take() {
                return Outgoing::Frame(bytes);
            }
            if *is_closing {
                client.is_gone = true;
                self.wake.notify_all();
                return Outgoing::Close;
            }
            state = self.wake.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Ends all connections after what is on the way was sent, for at most `most`.
    pub(super) fn close(&self, most: Duration) {
        let end = Instant::now() + most;
        let mut state = self.lock();
        state.is_closing = true;
        self.wake.notify_all();
        while !state.clients.is_empty() {
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                break;
            }
            state = self.wake.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    pub(super) fn is_closing(&self) -> bool {
        self.lock().is_closing
    }
}

impl State {
    /// Takes the request of the page that waits longest for its turn.
    fn next_look(&mut self) -> Option<(ClientId, LookRequest)> {
        let waiting = || self.clients.iter().filter(|(_, client)| client.waits()).map(|(&id, _)| id);
        let id = waiting().find(|&id| id > self.served).or_else(|| waiting().next())?;
        self.served = id;
        let client = self.clients.get_mut(&id)?;
        client.is_in_work = true;
        Some((id, client.pending.take()?))
    }
}

impl Client {
    fn waits(&self) -> bool {
        self.pending.is_some() && !self.is_in_work && self.ready.is_none()
    }

    fn put_on_wire(&mut self, seq: u32, bytes: Vec<u8>) {
        self.on_wire = Some((seq, bytes.len(), Instant::now()));
        self.next = Some(bytes);
    }

    fn reply(&mut self, text: Arc<str>) {
        // A page that takes nothing loses the oldest.
        if self.replies.len() >= REPLIES_MAX {
            self.replies.pop_front();
        }
        self.replies.push_back(text);
    }
}

#[cfg(test)]
mod tests {
    use super::super::message::Viewpoint;
    use super::*;

    fn look(seq: u32) -> Message {
        Message::Look(LookRequest { seq, from: Viewpoint::View(0), size: None, panes: Vec::new(), moving: true })
    }

    fn seq(task: Option<(ClientId, Message)>) -> Option<(ClientId, u32)> {
        match task? {
            (id, Message::Look(look)) => Some((id, look.seq)),
            other => panic!("{other:?}"),
        }
    }

    const NONE: Duration = Duration::ZERO;

    #[test]
    fn the_newest_camera_wins_and_one_frame_is_on_the_wire() {
        let hub = Hub::default();
        let id = hub.join().expect("a page");
        (1..=5).for_each(|n| hub.receive(id, look(n)));
        assert_eq!(seq(hub.next(NONE)), Some((id, 5)));
        hub.receive(id, look(6));
        assert_eq!(seq(hub.next(NONE)), None, "one in work");
        hub.finish(id, Some(&Frame { seq: 5, ..Frame::default() }));
        assert!(matches!(hub.outgoing(id), Outgoing::Frame(_)));
        assert_eq!(seq(hub.next(NONE)), Some((id, 6)), "while 5 is on the wire");
        hub.finish(id, Some(&Frame { seq: 6, ..Frame::default() }));
        hub.receive(id, look(7));
        assert_eq!(seq(hub.next(NONE)), None, "6 waits for the wire");
        hub.receive(id, Message::Ack { seq: 5 });
        assert!(matches!(hub.outgoing(id), Outgoing::Frame(_)));
        assert_eq!(seq(hub.next(NONE)), Some((id, 7)));
    }

    #[test]
    fn pages_have_turns_and_are_bounded() {
        let hub = Hub::default();
        let ids: Vec<ClientId> = std::iter::from_fn(|| hub.join()).collect();
        assert_eq!(ids.len(), CLIENTS_MAX);
        for round in 0..3 {
            ids.iter().for_each(|&id| hub.receive(id, look(round)));
            let served: Vec<_> = ids.iter().filter_map(|_| seq(hub.next(NONE))).map(|(id, _)| id).collect();
            assert_eq!(served, ids);
            ids.iter().for_each(|&id| hub.finish(id, None));
        }
        (0..1000).for_each(|_| hub.receive(ids[0], Message::Undo));
        assert_eq!(std::iter::from_fn(|| hub.next_message(true)).count(), TASKS_MAX);
        hub.receive(ids[0], Message::Undo);
        hub.leave(ids[0]);
        assert!(hub.next_message(true).is_none() && hub.join().is_some());
    }

    #[test]
    fn a_late_page_hears_the_newest_of_each_topic_once() {
        let hub = Hub::default();
        for n in 0..10 {
            hub.publish("state", &serde_json::json!({ "n": n }));
        }
        let id = hub.join().expect("a page");
        hub.reply(id, &serde_json::json!("an answer"));
        let mut texts = Vec::new();
        while texts.len() < 2 {
            match hub.outgoing(id) {
                Outgoing::Text(text) => texts.push(text.to_string()),
                other => panic!("{other:?}"),
            }
        }
        assert_eq!(texts, [r#"{"n":9}"#, "\"an answer\""]);
    }
}
