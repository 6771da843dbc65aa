//! Snapshots: all that the steps to come depend on, as numbers.
//!
//! One walk over a simulation both writes a snapshot and reads it ([`StateVisitor`]), so that the two cannot differ.

use std::slice::Iter;
use std::sync::Arc;

use kernels::Spatial;
use kernels::lane::Real;
use kernels::math::Vec3;
use rod::{Carried, Driven};

use crate::BodyPose;

/// A simulation at some time, to go on from as if nothing had happened since: see
/// [`crate::simulation::Simulation::snapshot`]. The default is of no simulation.
#[derive(Clone, Debug, Default)]
pub struct Snapshot {
    /// What tells simulations apart, the time, and all that follows.
    words: Vec<u64>,
    motions: Vec<Arc<Driven>>,
    obstacles: Vec<Carried>,
}

impl Snapshot {
    /// Time of the simulation [s]; 0 of no simulation.
    pub fn time(&self) -> f64 {
        self.words.get(1).map_or(0.0, |&bits| f64::from_bits(bits))
    }

    /// Which groups of lanes had come apart: what a simulation shows a visitor after its time.
    pub fn parted(&self) -> &[u64] {
        let count = self.words.get(2).map_or(0, |&count| count as usize);
        self.words.get(3..).and_then(|words| words.get(..count)).unwrap_or_default()
    }

    /// All of it as words, for a file; but for motions, which are the model's then.
    pub fn words(&self) -> &[u64] {
        &self.words
    }

    /// The snapshot of these [`Snapshot::words`]. A simulation that is restored from it keeps the motions that drive it,
    /// which must be those that drove it then.
    pub fn from_words(words: Vec<u64>) -> Self {
        Self { words, ..Self::default() }
    }

    /// Becomes what a walk says.
    pub fn write(&mut self, mut walk: impl FnMut(&mut StateVisitor<'_>)) {
        let layout = layout(&mut walk);
        let Self { words, motions, obstacles } = self;
        words.clear();
        motions.clear();
        obstacles.clear();
        words.push(layout);
        walk(&mut StateVisitor(Mode::Write { words, motions, obstacles }));
    }

    /// Makes what is walked over what it was. Returns whether it was that; if not, nothing has changed.
    pub fn read(&self, mut walk: impl FnMut(&mut StateVisitor<'_>)) -> bool {
        let Some((layout_then, words)) = self.words.split_first() else { return false };
        if *layout_then != layout(&mut walk) {
            return false;
        }
        let (motions, obstacles) = (self.motions.iter(), self.obstacles.iter());
        walk(&mut StateVisitor(Mode::Read { words: words.iter(), motions, obstacles }));
        true
    }
}

/// A hash of all sizes on the way (FNV-1a).
fn layout(walk: &mut impl FnMut(&mut StateVisitor<'_>)) -> u64 {
    let mut visitor = StateVisitor(Mode::Layout(0xcbf2_9ce4_8422_2325));
    walk(&mut visitor);
    if let Mode::Layout(hash) = visitor.0 { hash } else { 0 }
}

/// Takes what it is shown down, or makes it what was taken down: whatever has a memory shows it to a visitor, all of it,
/// always in the same order.
#[derive(Debug)]
pub struct StateVisitor<'a>(Mode<'a>);

#[derive(Debug)]
enum Mode<'a> {
    /// Sizes alone are looked at.
    Layout(u64),
    Write {
        words: &'a mut Vec<u64>,
        motions: &'a mut Vec<Arc<Driven>>,
        obstacles: &'a mut Vec<Carried>,
    },
    Read {
        words: Iter<'a, u64>,
        motions: Iter<'a, Arc<Driven>>,
        obstacles: Iter<'a, Carried>,
    },
}

impl StateVisitor<'_> {
    /// A size, or a kind as a number, that stays the same as long as the simulation lives. Where any of them is another one,
    /// the snapshot is of something else and is refused.
    #[inline]
    pub fn size(&mut self, size: usize) {
        if let Mode::Layout(hash) = &mut self.0 {
            *hash = (*hash ^ size as u64).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }

    /// A word.
    #[inline]
    pub fn word(&mut self, word: &mut u64) {
        match &mut self.0 {
            Mode::Layout(_) => {}
            Mode::Write { words, .. } => words.push(*word),
            Mode::Read { words, .. } => {
                if let Some(then) = words.next() {
                    *word = *then;
                }
            }
        }
    }

    /// A number, with all its bits.
    #[inline]
    pub fn number(&mut self, number: &mut f64) {
        let mut bits = number.to_bits();
        self.word(&mut bits);
        *number = f64::from_bits(bits);
    }

    /// A count that changes.
    #[inline]
    pub fn count(&mut self, count: &mut usize) {
        let mut word = *count as u64;
        self.word(&mut word);
        *count = word as usize;
    }

    /// A flag.
    #[inline]
    pub fn flag(&mut self, flag: &mut bool) {
        let mut word = u64::from(*flag);
        self.word(&mut word);
        *flag = word != 0;
    }

    /// A number in each lane.
    #[inline]
    pub(crate) fn real<T: Real>(&mut self, x: &mut T) {
        for lane in 0..T::LANES {
            let mut number = x.lane(lane);
            self.number(&mut number);
            x.set_lane(lane, number);
        }
    }

    /// A vector.
    #[inline]
    pub fn vector<T: Real>(&mut self, v: &mut Vec3<T>) {
        v.0.iter_mut().for_each(|x| self.real(x));
    }

    /// A spatial vector.
    #[inline]
    pub fn spatial<T: Real>(&mut self, x: &mut Spatial<T>) {
        self.vector(&mut x.linear);
        self.vector(&mut x.angular);
    }

    /// A pose.
    #[inline]
    pub(crate) fn pose<T: Real>(&mut self, pose: &mut BodyPose<T>) {
        self.vector(&mut pose.x);
        self.vector(&mut pose.q.v);
        self.real(&mut pose.q.w);
    }

    /// A list that stays as long as it is; `show` shows an entry.
    #[inline]
    pub fn list<T>(&mut self, list: &mut [T], mut show: impl FnMut(&mut Self, &mut T)) {
        self.size(list.len());
        if !matches!(self.0, Mode::Layout(_)) {
            list.iter_mut().for_each(|entry| show(self, entry));
        }
    }

    /// Whether what it is shown becomes what was taken down.
    pub fn is_reading(&self) -> bool {
        matches!(self.0, Mode::Read { .. })
    }

    /// A motion; `None` is one to come. It stays what it is where none was taken down.
    pub(crate) fn motion(&mut self, motion: &mut Option<Arc<Driven>>) {
        match &mut self.0 {
            Mode::Layout(_) => {}
            Mode::Write { motions, .. } => motions.extend(motion.clone()),
            Mode::Read { motions, .. } => {
                if let Some(then) = motions.next() {
                    *motion = Some(then.clone());
                }
            }
        }
    }

    /// What moves an obstacle, if anything does. It stays what it is where none was taken down.
    pub fn obstacle_motion(&mut self, motion: &mut Option<Carried>) {
        let mut is_driven = motion.is_some();
        self.flag(&mut is_driven);
        match &mut self.0 {
            Mode::Layout(_) => {}
            Mode::Write { obstacles, .. } => obstacles.extend(motion.clone()),
            Mode::Read { .. } if !is_driven => *motion = None,
            Mode::Read { obstacles, .. } => {
                if let Some(then) = obstacles.next() {
                    *motion = Some(then.clone());
                }
            }
        }
    }
}
