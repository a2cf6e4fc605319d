//! Finds objects from points in images, on a separate thread, so that pages are served meanwhile.

use super::hub::{ClientId, Hub};
use super::message::Message;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::label::click::{Area, Click, Hints, ObjectFinder, Photos, Progress};
use crate::scene::Gaussians;
use glam::DVec3;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;

/// A place or a box of an image.
#[derive(Debug)]
pub(super) enum Spot {
    /// In a photo: a pixel, or the corners of a box, as shares of its width and height.
    Photo(String, Vec<[f64; 2]>),
    /// On the surface, seen from an eye: a point, or what is in a box.
    Surface(Vec<DVec3>, DVec3),
}

/// A click or a box of a page.
#[derive(Debug)]
pub(super) enum Pointing {
    /// The object, or what does not belong to it.
    Click(Spot, bool),
    /// A box around it.
    Area(Spot),
}

/// A task of the thread.
enum Task {
    /// Look for objects in this model.
    Model(Box<Gaussians>),
    /// Look for the object that a page means.
    Point(ClientId, Pointing),
    /// Forget the object.
    Drop,
}

/// News about the object that is searched for.
#[derive(Clone, Debug)]
pub(super) enum News {
    /// Photos that were asked, of how many, and the seconds that photos take which were never asked.
    Asked { done: usize, all: usize, left: Option<f64> },
    /// It is these rows; the first answer, or the last.
    Found { rows: Arc<[bool]>, flags: Vec<(&'static str, String)>, is_last: bool },
    /// The work has ended without a new answer.
    Failed(ClientId, String),
}

/// The thread.
pub(super) struct Finder {
    tasks: Option<Sender<(u64, Task)>>,
    /// Number of the newest task; work for older ones ends.
    newest: Arc<AtomicU64>,
    thread: Option<JoinHandle<()>>,
}

impl Finder {
    /// Starts the thread, which reports its results to `hub`.
    pub(super) fn new(gpu: Arc<Gpu>, photos: Photos, near: f32, hub: Arc<Hub>) -> Self {
        let (tasks, asked) = channel();
        let newest = Arc::<AtomicU64>::default();
        let work = Work { gpu, near, hub, newest: Arc::clone(&newest) };
        let thread = std::thread::spawn(move || work.run(&photos, &asked));
        Self { tasks: Some(tasks), newest, thread: Some(thread) }
    }

    fn send(&self, task: Task) {
        let number = self.newest.fetch_add(1, Relaxed) + 1;
        // Without a thread there is no answer either; it ends with this value only.
        let _ = self.tasks.as_ref().map(|tasks| tasks.send((number, task)));
    }

    pub(super) fn set_model(&self, model: Gaussians) {
        self.send(Task::Model(Box::new(model)));
    }

    pub(super) fn point(&self, client: ClientId, pointed: Pointing) {
        self.send(Task::Point(client, pointed));
    }

    pub(super) fn forget(&self) {
        self.send(Task::Drop);
    }

    /// Returns the number of the newest task. News of older ones are of no use.
    pub(super) fn newest(&self) -> u64 {
        self.newest.load(Relaxed)
    }
}

impl Drop for Finder {
    fn drop(&mut self) {
        self.forget();
        self.tasks = None;
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// State of the thread.
struct Work {
    gpu: Arc<Gpu>,
    near: f32,
    hub: Arc<Hub>,
    newest: Arc<AtomicU64>,
}

/// The object that is searched for.
#[derive(Default)]
struct SearchTarget {
    hints: Hints,
    /// Those of the last answer.
    answered: Hints,
    client: ClientId,
}

impl Work {
    fn run(&self, photos: &Photos, tasks: &Receiver<(u64, Task)>) {
        let (mut clicking, mut wanted) = (None, SearchTarget::default());
        while let Ok((mut number, task)) = tasks.recv() {
            let mut next = Some(task);
            while let Some(task) = next {
                if let Err(error) = self.take(task, photos, &mut clicking, &mut wanted) {
                    self.tell(number, News::Failed(wanted.client, error.to_string()));
                }
                next = tasks.try_recv().ok().map(|(newer, task)| {
                    number = newer;
                    task
                });
            }
            if wanted.hints == wanted.answered {
                continue;
            }
            let Some(clicking) = &mut clicking else { continue };
            match self.find(number, photos, clicking, &wanted.hints) {
                Ok(()) => wanted.answered.clone_from(&wanted.hints),
                Err(Error::Interrupted) => {}
                Err(error) => {
                    wanted.hints.clone_from(&wanted.answered);
                    self.tell(number, News::Failed(wanted.client, error.to_string()));
                }
            }
        }
    }

    fn tell(&self, number: u64, news: News) {
        self.hub.note(Message::News { number, news });
    }

    /// Takes a task over into what is wanted.
    fn take<'a>(
        &self,
        task: Task,
        photos: &'a Photos,
        clicking: &mut Option<ObjectFinder<'a>>,
        wanted: &mut SearchTarget,
    ) -> Result<()> {
        match task {
            Task::Model(model) => {
                // Its memory is free before the next model needs some.
                *clicking = None;
                *clicking = Some(ObjectFinder::new(Arc::clone(&self.gpu), &model, photos, self.near)?);
            }
            Task::Point(client, pointed) => {
                wanted.client = client;
                let none = || Error::Bug("no model was set".to_owned());
                let clicking = clicking.as_mut().ok_or_else(none)?;
                match pointed {
                    Pointing::Click(spot, is_on) => {
                        let (view, pixels) = place(spot, photos, clicking)?;
                        let pixel = pixels.first().copied().unwrap_or_default();
                        wanted.hints.clicks.push(Click { view, pixel, is_on });
                    }
                    Pointing::Area(spot) => {
                        let (view, pixels) = place(spot, photos, clicking)?;
                        wanted.hints.area = Some(Area { view, corners: around(&pixels) });
                    }
                }
            }
            Task::Drop => {
                *wanted = SearchTarget::default();
                clicking.iter_mut().for_each(ObjectFinder::forget);
            }
        }
        Ok(())
    }

    fn find(&self, number: u64, photos: &Photos, clicking: &mut ObjectFinder, hints: &Hints) -> Result<()> {
        let flags = hints.flags(photos);
        let found = |rows: &[bool], is_last| News::Found { rows: rows.into(), flags: flags.clone(), is_last };
        let rows = clicking.object(hints, &mut |progress| {
            if self.newest.load(Relaxed) != number {
                return Err(Error::Interrupted);
            }
            self.tell(
                number,
                match progress {
                    Progress::Asked { done, all, left } => {
                        News::Asked { done, all, left: left.map(|left| left.as_secs_f64()) }
                    }
                    Progress::First(rows) => found(rows, false),
                },
            );
            Ok(())
        })?;
        self.tell(number, found(&rows, true));
        Ok(())
    }
}

/// Returns the photo of a spot, and its pixels there.
fn place(spot: Spot, photos: &Photos, clicking: &mut ObjectFinder) -> Result<(usize, Vec<[u32; 2]>)> {
    match spot {
        Spot::Photo(name, shares) => {
            let view = photos.index(&name)?;
            let (width, height) = photos.size(view);
            let along = |share: f64, side: u32| ((share * f64::from(side)).max(0.0) as u32).min(side - 1);
            Ok((view, shares.iter().map(|share| [along(share[0], width), along(share[1], height)]).collect()))
        }
        Spot::Surface(points, eye) => {
            let none = || Error::usage("point", "no photo shows this point; try another one");
            clicking.nearest(&points, eye)?.ok_or_else(none)
        }
    }
}

/// Returns the box around pixels: first column and row, and one past the last.
fn around(pixels: &[[u32; 2]]) -> [u32; 4] {
    let of = |axis: usize| pixels.iter().map(move |pixel| pixel[axis]);
    let least = |axis| of(axis).min().unwrap_or(0);
    let most = |axis| of(axis).max().unwrap_or(0) + 1;
    [least(0), least(1), most(0), most(1)]
}
