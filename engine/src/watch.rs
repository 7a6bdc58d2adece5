//! Whoever waits for long work: asks it to stop, and is told how far it is.
//!
//! Work that a graph starts has a watch of its own. It is the *current* one of the thread that starts the work;
//! whatever takes long asks for it once, at its beginning, takes it along to other threads, and looks at it
//! every few milliseconds. Work that was stopped ends early with something that means nothing, which nobody
//! may keep: who stopped it throws it away. Without a watch nothing is ever stopped.
//!
//! ```
//! use spandrel_engine::watch::Watch;
//!
//! let watch = Watch::new();
//! watch.begin(4);
//! watch.run(|| Watch::current().step());
//! assert_eq!((watch.share(), watch.is_stopped()), (Some(0.25), false));
//! watch.stop();
//! assert!(watch.run(|| Watch::current().is_stopped()));
//! assert!(!Watch::current().is_stopped());
//! ```

use std::any::Any;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use crate::error::{Error, Result};
use crate::key::Key;

thread_local! {
    static CURRENT: RefCell<Watch> = RefCell::default();
}

/// What stands between long work and whoever waits for it.
#[derive(Clone, Debug, Default)]
pub struct Watch(Option<Arc<Inner>>);

#[derive(Debug, Default)]
struct Inner {
    stop: Arc<AtomicBool>,
    done: AtomicU64,
    all: AtomicU64,
    /// The files that were read, and what they held; without a key if they were not there.
    files: Mutex<BTreeMap<PathBuf, Option<Key>>>,
    counts: Mutex<BTreeMap<&'static str, u64>>,
    /// What goes from one piece of work to the next.
    kept: Option<Arc<dyn Any + Send + Sync>>,
}

impl Watch {
    /// A watch over work that has not begun.
    pub fn new() -> Watch {
        Watch(Some(Arc::default()))
    }

    /// One that is stopped together with others, and hands on what they keep for each other.
    pub fn together<T: Any + Send + Sync>(stop: &Arc<AtomicBool>, kept: &Arc<T>) -> Watch {
        let (stop, kept) = (stop.clone(), Some(kept.clone() as _));
        Watch(Some(Arc::new(Inner { stop, kept, ..Inner::default() })))
    }

    /// What was kept by work before for work to come, if whoever watches keeps such things.
    pub(crate) fn kept<T: Any + Send + Sync>(&self) -> Option<Arc<T>> {
        self.0.as_ref()?.kept.clone()?.downcast().ok()
    }

    /// That of the work which this thread has begun.
    pub fn current() -> Watch {
        CURRENT.with_borrow(Clone::clone)
    }

    /// Does some work under this watch.
    pub fn run<T>(&self, work: impl FnOnce() -> T) -> T {
        /// Brings back the one before, also when the work panics.
        struct Back(Watch);
        impl Drop for Back {
            fn drop(&mut self) {
                CURRENT.set(std::mem::take(&mut self.0));
            }
        }
        let _back = Back(CURRENT.replace(self.clone()));
        work()
    }

    /// Asks the work to stop.
    pub fn stop(&self) {
        if let Some(inner) = &self.0 {
            inner.stop.store(true, Ordering::Relaxed);
        }
    }

    /// Whether the work is to stop: what it makes then is thrown away.
    #[inline]
    pub fn is_stopped(&self) -> bool {
        self.0.as_ref().is_some_and(|inner| inner.stop.load(Ordering::Relaxed))
    }

    /// # Errors
    /// [`Error::Cancelled`] if the work is to stop.
    #[inline]
    pub fn check(&self) -> Result<()> {
        if self.is_stopped() { Err(Error::Cancelled) } else { Ok(()) }
    }

    /// The work has so many steps more.
    pub fn begin(&self, steps: usize) {
        if let Some(inner) = &self.0 {
            inner.all.fetch_add(steps as u64, Ordering::Relaxed);
        }
    }

    /// A step is done.
    pub fn step(&self) {
        if let Some(inner) = &self.0 {
            inner.done.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// The share of the steps that is done, 0 to 1; `None` if none have begun.
    pub fn share(&self) -> Option<f64> {
        let inner = self.0.as_ref()?;
        let all = inner.all.load(Ordering::Relaxed);
        // The two are read one after the other, and steps go on meanwhile.
        let done = inner.done.load(Ordering::Relaxed).min(all);
        (all > 0).then(|| done as f64 / all as f64)
    }

    /// Counts something that is worth knowing of how the work was done, such as lines that were taken from the frame
    /// before.
    pub fn count(&self, what: &'static str, number: u64) {
        if let Some(inner) = &self.0 {
            let mut counts = inner.counts.lock().unwrap_or_else(PoisonError::into_inner);
            *counts.entry(what).or_default() += number;
        }
    }

    /// What was counted so far.
    pub fn counts(&self) -> BTreeMap<&'static str, u64> {
        let counts = self.0.as_ref().map(|inner| &inner.counts);
        let counts =
            counts.map(|counts| counts.lock().unwrap_or_else(PoisonError::into_inner).clone());
        counts.unwrap_or_default()
    }

    /// A file was read that held this, or was not there.
    pub(crate) fn saw(&self, path: &Path, contents: Option<Key>) {
        if let Some(inner) = &self.0 {
            let mut files = inner.files.lock().unwrap_or_else(PoisonError::into_inner);
            files.insert(path.to_owned(), contents);
        }
    }

    /// The files that the work has read so far, and what they held; those that were not there have no key.
    pub fn files(&self) -> BTreeMap<PathBuf, Option<Key>> {
        let files = self.0.as_ref().map(|inner| &inner.files);
        let files = files.map(|files| files.lock().unwrap_or_else(PoisonError::into_inner).clone());
        files.unwrap_or_default()
    }
}
