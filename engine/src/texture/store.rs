//! Where pictures are kept that surfaces show.

use std::cell::RefCell;
use std::collections::{BTreeSet, HashMap};
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use super::pyramid::{Level, Meaning, pyramid};
use crate::error::{Error, Result};
use crate::image::texels::Texels;
use crate::image::{Image, Window};
use crate::key::{Key, KeyHasher};
use crate::watch::Watch;

/// The bytes that the store holds if nobody says otherwise.
const USUAL_LIMIT: usize = 1 << 30;

/// A picture that can be read, again and again.
pub struct PictureSource {
    /// What it is: two sources with one key are one picture with one meaning.
    pub key: Key,
    /// What its samples mean.
    pub meaning: Meaning,
    /// How it is read.
    pub read: Box<dyn Fn() -> Result<Texels> + Send + Sync>,
}

impl PictureSource {
    /// A picture in memory, as colour, and whether it is opaque everywhere. What it does not hold is transparent.
    ///
    /// # Errors
    /// If it holds nothing, or a pixel is not finite.
    pub fn of(image: &Arc<Image>) -> Result<(PictureSource, bool)> {
        if image.window.area() == 0 {
            return Err(Error::invalid("the picture holds no pixels"));
        }
        let mut key = KeyHasher::new("image");
        key.value(&(&image.size, image.window));
        let width = image.window.width as usize;
        let mut is_opaque = image.window == Window::whole(image.size.0, image.size.1);
        for (at, pixel) in image.pixels().enumerate() {
            if !pixel.iter().all(|v| v.is_finite()) {
                let (x, y) =
                    (at % width + image.window.x as usize, at / width + image.window.y as usize);
                return Err(Error::invalid(format!(
                    "pixel {x}, {y} of the picture is not a finite number"
                )));
            }
            is_opaque &= pixel[3] >= 1.0;
            key.bytes(&pixel.map(f32::to_le_bytes).concat());
        }
        let held = image.clone();
        let read = move || -> Result<Texels> { Ok(Texels::of(&held.whole())) };
        let (key, meaning) = (key.finish(), Meaning::Color);
        Ok((PictureSource { key, meaning, read: Box::new(read) }, is_opaque))
    }
}

impl fmt::Debug for PictureSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Source").field("key", &self.key).field("meaning", &self.meaning).finish()
    }
}

/// Keeps levels of pictures, those that were used last, within a limit of bytes.
///
/// Of a picture only the levels that are asked for and coarser ones are kept, unless there is room for all:
/// what is far away takes little. What was dropped is read again when it is asked for.
#[derive(Debug)]
pub struct Store {
    held: Mutex<StoreState>,
    /// One picture is read at a time: pictures being read are not within the limit.
    reading: Mutex<()>,
}

#[derive(Debug)]
struct StoreState {
    limit: usize,
    bytes: usize,
    most: usize,
    reads: u64,
    clock: u64,
    pictures: HashMap<Key, KnownPicture>,
}

/// What is known of a picture.
#[derive(Debug)]
struct KnownPicture {
    size: (u32, u32),
    /// Its levels, those that are held, and when each was used.
    levels: Vec<Option<(Arc<Level>, u64)>>,
}

/// What a store held and read.
#[derive(Clone, Copy, Debug)]
pub struct StoreReport {
    /// The most bytes that were held.
    pub most: usize,
    /// How many pictures there are.
    pub pictures: usize,
    /// How often one was read.
    pub reads: u64,
}

/// The store of this process.
pub fn store() -> &'static Store {
    static STORE: OnceLock<Store> = OnceLock::new();
    STORE.get_or_init(|| Store::new(USUAL_LIMIT))
}

impl Store {
    /// An empty store with a limit in bytes.
    pub fn new(limit: usize) -> Store {
        let (pictures, reading) = (HashMap::new(), Mutex::new(()));
        let held = StoreState { limit, bytes: 0, most: 0, reads: 0, clock: 0, pictures };
        Store { held: Mutex::new(held), reading }
    }

    fn held(&self) -> MutexGuard<'_, StoreState> {
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes the limit in bytes.
    pub fn set_limit(&self, limit: usize) {
        let mut held = self.held();
        held.limit = limit;
        held.drop_oldest(None);
    }

    /// The limit in bytes.
    pub fn limit(&self) -> usize {
        self.held().limit
    }

    /// Drops all pictures but some: room for these.
    pub fn keep_only(&self, keys: &BTreeSet<Key>) {
        let mut held = self.held();
        let mut dropped = 0;
        for (_, picture) in held.pictures.iter_mut().filter(|(key, _)| !keys.contains(key)) {
            let levels = picture.levels.iter_mut().filter_map(Option::take);
            dropped += levels.map(|(level, _)| level.bytes()).sum::<usize>();
        }
        held.bytes -= dropped;
    }

    /// What was held and read so far.
    pub fn report(&self) -> StoreReport {
        let held = self.held();
        StoreReport { most: held.most, pictures: held.pictures.len(), reads: held.reads }
    }

    /// A picture, for some time at hand.
    ///
    /// # Errors
    /// If it must be read and cannot be.
    pub fn open<'s>(&'s self, source: &'s PictureSource) -> Result<Opened<'s>> {
        let known = |held: &StoreState| {
            held.pictures.get(&source.key).map(|picture| (picture.size, picture.levels.len()))
        };
        let mut found = known(&self.held());
        if found.is_none() {
            // The coarsest is asked for: finer ones are kept if there is room.
            self.read(source, u32::MAX)?;
            found = known(&self.held());
        }
        let (size, count) = found.unwrap_or(((1, 1), 1));
        Ok(Opened { store: self, source, size, levels: RefCell::new(vec![None; count]) })
    }

    /// A level of a picture, 0 the picture itself.
    fn level(&self, source: &PictureSource, number: u32) -> Result<Arc<Level>> {
        let known = self.held().find(source.key, number);
        known.map_or_else(|| self.read(source, number), Ok)
    }

    /// Reads a picture, and returns one of its levels.
    fn read(&self, source: &PictureSource, number: u32) -> Result<Arc<Level>> {
        let _reading = self.reading.lock().unwrap_or_else(PoisonError::into_inner);
        // Another may have read it meanwhile.
        let known = self.held().find(source.key, number);
        if let Some(level) = known {
            return Ok(level);
        }
        // Whoever asks first has not read it: that it is read now is chance.
        let levels = pyramid(Watch::default().run(&source.read)?, source.meaning);
        let levels: Vec<Arc<Level>> = levels.into_iter().map(Arc::new).collect();
        let wanted = (number as usize).min(levels.len() - 1);
        let mut held = self.held();
        held.reads += 1;
        held.put(source.key, &levels, wanted);
        Ok(levels[wanted].clone())
    }
}

impl StoreState {
    fn find(&mut self, key: Key, number: u32) -> Option<Arc<Level>> {
        self.clock += 1;
        let levels = &mut self.pictures.get_mut(&key)?.levels;
        let at = (number as usize).min(levels.len() - 1);
        let (level, used) = levels[at].as_mut()?;
        *used = self.clock;
        Some(level.clone())
    }

    /// Keeps the levels from one on, and finer ones as long as there is room.
    fn put(&mut self, key: Key, levels: &[Arc<Level>], wanted: usize) {
        self.clock += 1;
        let clock = self.clock;
        let size = (levels[0].width, levels[0].height);
        let nothing = || KnownPicture { size, levels: vec![None; levels.len()] };
        let known = &mut self.pictures.entry(key).or_insert_with(nothing).levels;
        // The coarsest first: they take little, and whoever asks for a fine level asks for them
        // too.
        for (number, level) in levels.iter().enumerate().rev() {
            let has_room = self.bytes + level.bytes() <= self.limit;
            if known[number].is_some() || (number < wanted && !has_room) {
                continue;
            }
            known[number] = Some((level.clone(), clock));
            self.bytes += level.bytes();
        }
        self.drop_oldest(Some((key, wanted)));
        self.most = self.most.max(self.bytes);
    }

    /// Drops what was not used for longest until the limit holds; a level that is used now, and those coarser than it,
    /// which take little beside it and are asked for with it, are kept.
    fn drop_oldest(&mut self, but: Option<(Key, usize)>) {
        while self.bytes > self.limit {
            let levels = self.pictures.iter().flat_map(|(key, picture)| {
                let held = picture.levels.iter().enumerate();
                held.filter_map(|(n, level)| level.as_ref().map(|(_, used)| (*used, n, *key)))
            });
            // Of one picture the finest first.
            let is_used =
                |n: usize, key: Key| but.is_some_and(|(own, from)| own == key && n >= from);
            let oldest = levels.filter(|(_, n, key)| !is_used(*n, *key)).min();
            let Some((_, number, key)) = oldest else { break };
            if let Some((level, _)) =
                self.pictures.get_mut(&key).and_then(|picture| picture.levels[number].take())
            {
                self.bytes -= level.bytes();
            }
        }
    }
}

/// A picture at hand, for a batch of fragments.
pub struct Opened<'s> {
    store: &'s Store,
    source: &'s PictureSource,
    /// Columns and rows.
    pub size: (u32, u32),
    levels: RefCell<Vec<Option<Arc<Level>>>>,
}

impl Opened<'_> {
    /// The number of levels.
    pub fn count(&self) -> u32 {
        self.levels.borrow().len() as u32
    }

    /// What its samples mean.
    pub fn meaning(&self) -> Meaning {
        self.source.meaning
    }

    /// A level, 0 the picture itself; the last for all beyond.
    ///
    /// # Errors
    /// If it must be read and cannot be.
    pub fn level(&self, number: u32) -> Result<Arc<Level>> {
        let at = (number as usize).min(self.levels.borrow().len() - 1);
        if let Some(level) = &self.levels.borrow()[at] {
            return Ok(level.clone());
        }
        let level = self.store.level(self.source, number)?;
        self.levels.borrow_mut()[at] = Some(level.clone());
        Ok(level)
    }
}
