//! File dialogs, on their own threads so that the window stays responsive.
//!
//! The dialog of the system is opened through the desktop portal. Without a portal it returns "nothing chosen" at once.
//! Nobody presses Cancel that fast, so such an answer opens a dialog of our own.
//!
//! Before files are replaced the user is asked, by the dialog of the system or by a question of our own.

mod asked;
mod own_dialog;
mod replace_question;
mod target;

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

pub use asked::Asked;
use own_dialog::OwnDialog;
use replace_question::{Decision, ReplaceQuestion};
use target::{replaced_files, with_extension};

/// A system dialog that returns nothing within this time was never shown.
const NEVER_SHOWN: Duration = Duration::from_millis(400);
enum Answer {
    Chosen(Asked, PathBuf),
    NothingChosen,
    NoDialog(Asked),
}

/// The open dialog, if any, and the paths chosen.
pub struct Dialogs {
    /// The name from which those of new files are made.
    pub suggested_name: String,
    /// Whether no dialog of the system is opened.
    pub only_own: bool,
    sender: Sender<Answer>,
    receiver: Receiver<Answer>,
    waiting: bool,
    own: Option<OwnDialog>,
    question: Option<ReplaceQuestion>,
    ready: Vec<(Asked, PathBuf)>,
}

impl Default for Dialogs {
    fn default() -> Self {
        let (sender, receiver) = channel();
        Self {
            suggested_name: String::new(),
            only_own: false,
            sender,
            receiver,
            waiting: false,
            own: None,
            question: None,
            ready: Vec::new(),
        }
    }
}

impl Dialogs {
    /// Opens a dialog unless one is open.
    pub fn ask(&mut self, asked: Asked, ctx: &egui::Context) {
        if self.waiting || self.is_open() {
            return;
        }
        if self.only_own {
            self.own = Some(OwnDialog::new(asked, &self.file_name(asked)));
            return;
        }
        let (sender, ctx, name) = (self.sender.clone(), ctx.clone(), self.file_name(asked));
        let run = move || {
            let start = Instant::now();
            let answer = match system_dialog(asked, &name) {
                Some(path) => Answer::Chosen(asked, path),
                None if start.elapsed() < NEVER_SHOWN => Answer::NoDialog(asked),
                None => Answer::NothingChosen,
            };
            drop(sender.send(answer));
            ctx.request_repaint();
        };
        match std::thread::Builder::new().name("dialog".into()).spawn(run) {
            Ok(_) => self.waiting = true,
            Err(_) => self.own = Some(OwnDialog::new(asked, &self.file_name(asked))),
        }
    }

    /// Whether a dialog of our own or a question is open, which takes the keyboard.
    pub fn is_open(&self) -> bool {
        self.own.is_some() || self.question.is_some()
    }

    fn file_name(&self, asked: Asked) -> String {
        let stem = Path::new(&self.suggested_name).file_stem().map(|s| s.to_string_lossy().to_lowercase());
        let stem = stem.filter(|s| !s.is_empty()).unwrap_or_else(|| "design".into());
        match asked {
            Asked::Open => String::new(),
            Asked::Save => format!("{stem}.plait"),
            Asked::Export => format!("{stem}-layout"),
        }
    }

    /// The paths chosen since the last call.
    pub fn answers(&mut self) -> Vec<(Asked, PathBuf)> {
        while let Ok(answer) = self.receiver.try_recv() {
            self.waiting = false;
            match answer {
                Answer::Chosen(asked, path) => self.chosen_by_system(asked, path),
                Answer::NothingChosen => {}
                Answer::NoDialog(asked) => self.own = Some(OwnDialog::new(asked, &self.file_name(asked))),
            }
        }
        std::mem::take(&mut self.ready)
    }

    /// Takes a path from the dialog of the system, which has asked whether the file is replaced that the user named.
    fn chosen_by_system(&mut self, asked: Asked, path: PathBuf) {
        let target = with_extension(asked, path.clone());
        let mut files = replaced_files(asked, &target);
        if asked == Asked::Save && target == path {
            files.clear();
        }
        self.confirm(asked, target, files);
    }

    /// Confirms a path, or asks first if these files are replaced.
    fn confirm(&mut self, asked: Asked, path: PathBuf, files: Vec<PathBuf>) {
        if files.is_empty() {
            self.own = None;
            self.ready.push((asked, path));
        } else {
            self.question = Some(ReplaceQuestion::new(asked, path, files));
        }
    }

    /// Shows our own dialog and the question, if they are open.
    pub fn show(&mut self, ctx: &egui::Context) {
        if let Some(own) = &mut self.own
            && self.question.is_none()
        {
            match own.show(ctx) {
                Some(Some(path)) => {
                    let asked = own.asked;
                    let path = with_extension(asked, path);
                    let files = replaced_files(asked, &path);
                    self.confirm(asked, path, files);
                    ctx.request_repaint();
                }
                Some(None) => self.own = None,
                None => {}
            }
        } else if let Some(question) = &self.question {
            match question.show(ctx) {
                Some(Decision::Replace) => {
                    let (asked, path) = (question.asked, question.path.clone());
                    self.question = None;
                    self.confirm(asked, path, Vec::new());
                    ctx.request_repaint();
                }
                // Our own dialog is shown again, so that another name can be chosen.
                Some(Decision::Keep) => self.question = None,
                None => {}
            }
        }
    }
}

fn system_dialog(asked: Asked, name: &str) -> Option<PathBuf> {
    let dialog = rfd::FileDialog::new().set_title(asked.title());
    match asked {
        Asked::Open => dialog.add_filter("Meshes and designs", asked.extensions()).pick_file(),
        Asked::Save => dialog.add_filter("Plait design", asked.extensions()).set_file_name(name).save_file(),
        Asked::Export => dialog.pick_folder(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn file_names_are_made_from_the_name_of_the_model() {
        let dialogs = Dialogs { suggested_name: "Bunny.obj".into(), ..Dialogs::default() };
        assert_eq!(dialogs.file_name(Asked::Save), "bunny.plait");
        assert_eq!(dialogs.file_name(Asked::Export), "bunny-layout");
        assert_eq!(Dialogs::default().file_name(Asked::Save), "design.plait");
    }

    #[test]
    fn the_system_asks_about_the_name_that_was_typed_and_we_about_the_one_with_its_extension() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.plait");
        std::fs::write(&path, "").unwrap();
        let mut dialogs = Dialogs::default();
        dialogs.chosen_by_system(Asked::Save, path.clone());
        assert_eq!(dialogs.answers(), [(Asked::Save, path.clone())]);
        dialogs.chosen_by_system(Asked::Save, folder.path().join("a"));
        assert!(dialogs.answers().is_empty());
        assert!(dialogs.question.is_some_and(|q| q.path == path));
    }
}
