//! Messages that lie over the view until they are put away; good news goes by itself.

use std::time::{Duration, Instant};

use glam::DVec3;

/// How long good news and notes stay.
const STAY: Duration = Duration::from_secs(8);
/// More than these would cover the view.
const MOST: usize = 4;

/// How a message is meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tone {
    /// Something was done.
    Done,
    /// Something to know.
    Note,
    /// Something could not be done.
    Failed,
}

/// One message.
#[derive(Debug, Clone)]
pub struct Message {
    /// Names it.
    pub id: u64,
    /// How it is meant.
    pub tone: Tone,
    /// What it says.
    pub text: String,
    /// The place it speaks of.
    pub place: Option<DVec3>,
    until: Option<Instant>,
}

/// The messages shown, oldest first.
#[derive(Debug, Default)]
pub struct Messages {
    list: Vec<Message>,
    next: u64,
}

impl Messages {
    /// Adds a message; failures stay until they are dismissed.
    pub fn add(&mut self, tone: Tone, text: String, place: Option<DVec3>) {
        self.list.retain(|m| m.text != text);
        self.next += 1;
        let until = (tone != Tone::Failed).then(|| Instant::now() + STAY);
        self.list.push(Message { id: self.next, tone, text, place, until });
        if self.list.len() > MOST {
            self.list.remove(0);
        }
    }

    /// Puts one away.
    pub fn dismiss(&mut self, id: u64) {
        self.list.retain(|m| m.id != id);
    }

    /// Puts all away.
    pub fn clear(&mut self) {
        self.list.clear();
    }

    /// Those to show now, and when the next one goes.
    pub fn current(&mut self) -> (Vec<Message>, Option<Duration>) {
        let now = Instant::now();
        self.list.retain(|m| m.until.is_none_or(|u| u > now));
        let next = self.list.iter().filter_map(|m| m.until).min();
        (self.list.clone(), next.map(|u| u - now))
    }

    /// The place of the newest message that has one.
    pub fn place(&self) -> Option<DVec3> {
        self.list.iter().rev().find_map(|m| m.place)
    }
}
