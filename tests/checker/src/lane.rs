//! What an invocation knows of the others: its clock.
//!
//! An invocation counts its own release fences. An access is stamped with the count at that time, and precedes a fence
//! if its stamp is less than the count after the fence. Two accesses are ordered if a chain of fences, barriers and
//! atomics leads from one to the other:
//!
//! * Within a workgroup: fence of the first, barrier, fence of the second. A control barrier that names buffers in its
//!   semantics is all three.
//! * Between workgroups: device fence of the first, its atomic on a word, an atomic on this word that comes later,
//!   device fence of the second. An atomic hands over what its own invocation knows, not its workgroup: a release of
//!   the whole workgroup needs a fence, a barrier, and another fence of the invocation with the atomic.
//!
//! `barrier()` of GLSL names shared memory only.

use std::collections::HashMap;
use std::rc::Rc;

/// Stands for all invocations of a workgroup.
pub const MANY: u16 = u16::MAX;

/// Counts of fences up to which the accesses of invocations of other workgroups are known, by workgroup and lane.
#[derive(Clone, Debug, Default)]
pub struct Clock(HashMap<(u32, u16), u32>);

impl Clock {
    /// True if an access with this stamp is known.
    pub fn covers(&self, group: u32, lane: u16, time: u32) -> bool {
        let knows = |lane| self.0.get(&(group, lane)).is_some_and(|known| *known > time);
        knows(MANY) || knows(lane)
    }

    fn raise(&mut self, key: (u32, u16), time: u32) {
        let known = self.0.entry(key).or_default();
        *known = time.max(*known);
    }

    /// Adds what another clock knows.
    pub fn join(&mut self, other: &Self) {
        other.0.iter().for_each(|(key, time)| self.raise(*key, *time));
    }
}

/// A clock that many invocations share.
pub type SharedClock = Option<Rc<Clock>>;

/// Adds what `more` knows to `clock`.
pub fn join(clock: &mut SharedClock, more: &SharedClock) {
    match (&mut *clock, more) {
        (_, None) => {}
        (None, Some(_)) => clock.clone_from(more),
        (Some(known), Some(more)) if Rc::ptr_eq(known, more) => {}
        (Some(known), Some(more)) => Rc::make_mut(known).join(more),
    }
}

/// Synchronisation of one invocation.
#[derive(Clone, Debug, Default)]
pub struct Lane {
    /// Its workgroup.
    pub group: u32,
    /// Its number in the workgroup.
    pub number: u16,
    /// Its subgroup.
    pub subgroup: u16,
    /// Barriers of its subgroup that it has passed.
    pub subgroup_epoch: u32,
    /// Barriers of its workgroup that it has passed.
    pub epoch: u32,
    /// Fences so far: the stamp of accesses.
    pub time: u32,
    /// Accesses of its workgroup with a stamp below are known.
    pub horizon: u32,
    /// What it released by its last fence: own accesses below this stamp.
    pub fenced: u32,
    /// What a fence after the last barrier acquires.
    pub pending: u32,
    /// Accesses of other workgroups that it knows.
    pub known: SharedClock,
    /// What it knew at its last fence.
    released_known: SharedClock,
    /// The same, of what a fence after the last barrier acquires.
    pub pending_known: SharedClock,
    /// Read by atomics; the next fence acquires it.
    acquiring: SharedClock,
    /// What its last device fence released to other workgroups: own stamp, horizon, and known accesses of others.
    offer: Option<(u32, u32, SharedClock)>,
    /// Fences since the last barrier, as a hash: all invocations of a workgroup have the same.
    pub trail: u32,
    /// The same of fences of subgroup scope.
    pub subgroup_trail: u32,
}

impl Lane {
    /// An invocation that knows nothing of others.
    pub fn new(group: u32, number: u16, subgroup: u16) -> Self {
        Self { group, number, subgroup, ..Self::default() }
    }

    /// An acquire and release fence for buffers.
    pub fn fence(&mut self, is_device: bool) {
        self.time += 1;
        self.horizon = self.horizon.max(self.pending);
        join(&mut self.known, &self.pending_known);
        self.fenced = self.time;
        if is_device {
            self.device_fence();
        }
        self.released_known.clone_from(&self.known);
    }

    fn device_fence(&mut self) {
        let read = self.acquiring.take();
        join(&mut self.known, &read);
        self.offer = Some((self.time, self.horizon, self.known.clone()));
    }

    /// What other workgroups learn from an atomic of this invocation is added to the word's clock, and this invocation
    /// reads it.
    pub fn atomic(&mut self, word: &mut Clock) {
        if !word.0.is_empty() {
            join(&mut self.acquiring, &Some(Rc::new(word.clone())));
        }
        if let Some((own, horizon, known)) = &self.offer {
            word.raise((self.group, self.number), *own);
            word.raise((self.group, MANY), *horizon);
            known.iter().for_each(|known| word.join(known));
        }
    }

    /// True if atomics of this invocation have something to hand over.
    pub fn offers(&self) -> bool {
        self.offer.is_some()
    }
}

/// What the fences before a barrier released, for those after it.
#[derive(Debug)]
pub struct Released {
    time: u32,
    fenced: u32,
    known: SharedClock,
    orders: Option<bool>,
}

impl Released {
    /// Collects from all invocations of a workgroup. `orders` is set if the barrier itself orders buffers, to whether
    /// it does so for the whole device.
    pub fn new<'a>(lanes: impl Iterator<Item = &'a Lane>, orders: Option<bool>) -> Self {
        let mut all = Self { time: 0, fenced: u32::MAX, known: None, orders };
        for lane in lanes {
            all.time = all.time.max(lane.time);
            all.fenced = all.fenced.min(lane.fenced);
            join(&mut all.known, if orders.is_some() { &lane.known } else { &lane.released_known });
            if orders == Some(true) {
                join(&mut all.known, &lane.acquiring);
            }
        }
        all
    }

    /// Lets an invocation pass the barrier.
    pub fn pass(&self, lane: &mut Lane) {
        let Some(is_device) = self.orders else {
            lane.pending = self.fenced;
            lane.pending_known.clone_from(&self.known);
            return;
        };
        lane.time = self.time + 1;
        (lane.horizon, lane.pending, lane.fenced) = (lane.time, lane.time, lane.time);
        lane.known.clone_from(&self.known);
        lane.released_known.clone_from(&self.known);
        lane.pending_known.clone_from(&self.known);
        if is_device {
            lane.device_fence();
        }
    }
}
