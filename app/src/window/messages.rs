//! Messages over the view. Errors stay until they are dismissed, all others disappear after some seconds.

use std::time::{Duration, Instant};

use glam::DVec3;

/// How long messages other than errors stay.
const DURATION: Duration = Duration::from_secs(8);
/// Most messages at a time; the oldest is dropped. More would cover the view.
const MAX_MESSAGES: usize = 4;

/// The kind of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tone {
    /// An operation succeeded.
    Done,
    /// A note.
    Note,
    /// An operation failed.
    Failed,
}

/// One message.
#[derive(Debug, Clone)]
pub struct Message {
    /// Its identifier.
    pub id: u64,
    /// Its kind.
    pub tone: Tone,
    /// Its text.
    pub text: String,
    /// The place on the model that it is about.
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
    /// Adds a message, in place of an older one with the same text.
    pub fn add(&mut self, tone: Tone, text: String, place: Option<DVec3>) {
        self.list.retain(|m| m.text != text);
        self.next += 1;
        let until = (tone != Tone::Failed).then(|| Instant::now() + DURATION);
        self.list.push(Message { id: self.next, tone, text, place, until });
        if self.list.len() > MAX_MESSAGES {
            self.list.remove(0);
        }
    }

    /// Removes a message.
    pub fn dismiss(&mut self, id: u64) {
        self.list.retain(|m| m.id != id);
    }

    /// Removes all messages.
    pub fn clear(&mut self) {
        self.list.clear();
    }

    /// The messages to show, and the time until the next one disappears.
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

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(messages: &mut Messages) -> Vec<String> {
        messages.current().0.into_iter().map(|m| m.text).collect()
    }

    #[test]
    fn the_oldest_message_is_dropped() {
        let mut messages = Messages::default();
        (0..=MAX_MESSAGES).for_each(|i| messages.add(Tone::Failed, i.to_string(), None));
        assert_eq!(texts(&mut messages), ["1", "2", "3", "4"]);
    }

    #[test]
    fn a_repeated_message_is_shown_once_and_last() {
        let mut messages = Messages::default();
        for text in ["a", "b", "a"] {
            messages.add(Tone::Note, text.into(), None);
        }
        assert_eq!(texts(&mut messages), ["b", "a"]);
    }

    #[test]
    fn errors_stay_and_notes_disappear() {
        let mut messages = Messages::default();
        messages.add(Tone::Failed, "error".into(), None);
        assert_eq!(messages.current().1, None);
        messages.add(Tone::Note, "note".into(), None);
        assert!(messages.current().1.is_some_and(|d| d <= DURATION));
    }

    #[test]
    fn the_newest_place_is_marked_until_its_message_is_dismissed() {
        let mut messages = Messages::default();
        messages.add(Tone::Failed, "first".into(), Some(DVec3::X));
        messages.add(Tone::Failed, "second".into(), Some(DVec3::Y));
        messages.add(Tone::Note, "without a place".into(), None);
        assert_eq!(messages.place(), Some(DVec3::Y));
        let second = messages.current().0[1].id;
        messages.dismiss(second);
        assert_eq!(messages.place(), Some(DVec3::X));
    }
}
