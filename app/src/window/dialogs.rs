//! File dialogs, on their own threads so that the window goes on.
//!
//! The dialog of the system is opened through the desktop portal. Without a portal it returns "nothing chosen" at once.
//! Nobody presses Cancel that fast, so such an answer opens a dialog of our own.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

/// A system dialog that returns nothing within this time was never shown.
const NEVER_SHOWN: Duration = Duration::from_millis(400);
/// File name extensions that can be opened.
const OPENABLE: [&str; 5] = ["obj", "off", "ply", "stl", "plait"];

/// The purpose of a dialog.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Asked {
    /// A mesh or design to read.
    Open,
    /// A design to write.
    Save,
    /// A folder to export into.
    Export,
}

impl Asked {
    fn title(self) -> &'static str {
        match self {
            Self::Open => "Open a mesh or a design",
            Self::Save => "Save the design",
            Self::Export => "Export the layout into a folder",
        }
    }
}

enum Answer {
    Chosen(Asked, PathBuf),
    NothingChosen,
    NoDialog(Asked),
}

/// The open dialog, if any, and the paths chosen.
pub struct Dialogs {
    /// The name from which those of new files are made.
    pub suggested_name: String,
    sender: Sender<Answer>,
    receiver: Receiver<Answer>,
    waiting: bool,
    own: Option<OwnDialog>,
    ready: Vec<(Asked, PathBuf)>,
}

impl Default for Dialogs {
    fn default() -> Self {
        let (sender, receiver) = channel();
        Self { suggested_name: String::new(), sender, receiver, waiting: false, own: None, ready: Vec::new() }
    }
}

impl Dialogs {
    /// Opens a dialog unless one is open.
    pub fn ask(&mut self, asked: Asked, ctx: &egui::Context) {
        if self.waiting || self.own.is_some() {
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

    /// Whether our own dialog is open, which takes the keyboard.
    pub fn is_open(&self) -> bool {
        self.own.is_some()
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
                Answer::Chosen(asked, path) => self.ready.push((asked, path)),
                Answer::NothingChosen => {}
                Answer::NoDialog(asked) => self.own = Some(OwnDialog::new(asked, &self.file_name(asked))),
            }
        }
        std::mem::take(&mut self.ready)
    }

    /// Shows our own dialog, if it is open.
    pub fn show(&mut self, ctx: &egui::Context) {
        let Some(own) = &mut self.own else { return };
        match own.show(ctx) {
            Some(Some(path)) => {
                self.ready.push((own.asked, path));
                self.own = None;
                ctx.request_repaint();
            }
            Some(None) => self.own = None,
            None => {}
        }
    }
}

fn system_dialog(asked: Asked, name: &str) -> Option<PathBuf> {
    let dialog = rfd::FileDialog::new().set_title(asked.title());
    match asked {
        Asked::Open => dialog.add_filter("Meshes and designs", &OPENABLE).pick_file(),
        Asked::Save => dialog.add_filter("Plait design", &["plait"]).set_file_name(name).save_file(),
        Asked::Export => dialog.pick_folder(),
    }
}

/// Our own dialog: the entries of a folder, and a text field for the name.
struct OwnDialog {
    asked: Asked,
    folder: PathBuf,
    name: String,
    entries: Vec<(String, bool)>,
    error: Option<String>,
    /// Whether the text field has been focused.
    focused: bool,
}

impl OwnDialog {
    fn new(asked: Asked, name: &str) -> Self {
        let folder = std::env::current_dir().unwrap_or_else(|_| PathBuf::from("/"));
        let mut dialog =
            Self { asked, folder, name: name.to_owned(), entries: Vec::new(), error: None, focused: false };
        dialog.list();
        dialog
    }

    /// Lists the folder: first the sub-folders, then the files that can be opened.
    fn list(&mut self) {
        self.entries.clear();
        self.error = None;
        let read = match std::fs::read_dir(&self.folder) {
            Ok(read) => read,
            Err(e) => {
                self.error = Some(format!("{} cannot be read: {e}", self.folder.display()));
                return;
            }
        };
        for entry in read.flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            let folder = entry.path().is_dir();
            let known = Path::new(&name).extension().is_some_and(|e| {
                let e = e.to_string_lossy().to_lowercase();
                OPENABLE.contains(&e.as_str())
            });
            if !name.starts_with('.') && (folder || (known && self.asked != Asked::Export)) {
                self.entries.push((name, folder));
            }
        }
        self.entries.sort_by_key(|(name, folder)| (!folder, name.to_lowercase()));
    }

    fn enter(&mut self, folder: PathBuf) {
        self.folder = folder;
        self.focused = false;
        self.list();
    }

    /// The path of the text field. A folder is entered instead, unless the dialog asks for a folder.
    fn accept(&mut self) -> Option<PathBuf> {
        let path = self.folder.join(self.name.trim());
        if self.asked != Asked::Export && path.is_dir() {
            self.name.clear();
            self.enter(path);
            return None;
        }
        if self.asked == Asked::Open && !path.is_file() {
            self.error = Some(format!("There is no file {}", path.display()));
            return None;
        }
        Some(path)
    }

    /// Shows the dialog. `Some(Some(path))`: chosen; `Some(None)`: cancelled.
    fn show(&mut self, ctx: &egui::Context) -> Option<Option<PathBuf>> {
        let mut result = None;
        let frame = egui::Frame::window(&ctx.global_style()).inner_margin(18.0);
        let response = egui::Modal::new(egui::Id::unique("file dialog")).frame(frame).show(ctx, |ui| {
            ui.set_width(520.0);
            ui.heading(self.asked.title());
            ui.horizontal(|ui| {
                if ui.button("Up").clicked()
                    && let Some(parent) = self.folder.parent().map(Path::to_path_buf)
                {
                    self.enter(parent);
                }
                ui.add(egui::Label::new(self.folder.display().to_string()).truncate());
            });
            self.list_entries(ui, &mut result);
            ui.horizontal(|ui| {
                let label = ui.label("Name");
                let width = (ui.available_width() - 4.0).max(60.0);
                let line =
                    ui.add(egui::TextEdit::singleline(&mut self.name).desired_width(width)).labelled_by(label.id);
                if line.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter)) {
                    result = self.accept().map(Some);
                    self.focused = false;
                }
                if !std::mem::replace(&mut self.focused, true) {
                    line.request_focus();
                }
            });
            if let Some(error) = &self.error {
                ui.colored_label(super::theme::BAD, error);
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let verb = match self.asked {
                    Asked::Open => "Open",
                    Asked::Save => "Save",
                    Asked::Export => "Export",
                };
                if ui.button(verb).clicked() {
                    result = self.accept().map(Some);
                }
                if ui.button("Cancel").clicked() {
                    result = Some(None);
                }
            });
        });
        if result.is_none() && response.should_close() { Some(None) } else { result }
    }

    fn list_entries(&mut self, ui: &mut egui::Ui, result: &mut Option<Option<PathBuf>>) {
        let mut enter = None;
        egui::ScrollArea::vertical().max_height(280.0).auto_shrink([false, false]).show(ui, |ui| {
            for (name, folder) in &self.entries {
                let text = if *folder { format!("{name}/") } else { name.clone() };
                let response = ui.selectable_label(*name == self.name, text);
                if response.clicked() && *folder {
                    enter = Some(self.folder.join(name));
                } else if response.double_clicked() {
                    *result = Some(Some(self.folder.join(name)));
                } else if response.clicked() {
                    self.name.clone_from(name);
                }
            }
        });
        if let Some(folder) = enter {
            self.enter(folder);
        }
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
    fn only_folders_and_files_that_can_be_opened_are_listed() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["b.OBJ", "a.plait", "notes.txt", ".hidden.obj"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        std::fs::create_dir(folder.path().join("z")).unwrap();
        let mut dialog = OwnDialog::new(Asked::Open, "");
        dialog.enter(folder.path().to_path_buf());
        let names: Vec<_> = dialog.entries.iter().map(|e| e.0.as_str()).collect();
        assert_eq!(names, ["z", "a.plait", "b.OBJ"]);
        dialog.asked = Asked::Export;
        dialog.list();
        assert_eq!(dialog.entries, [("z".to_owned(), true)]);
    }

    #[test]
    fn a_missing_file_is_not_opened() {
        let folder = tempfile::tempdir().unwrap();
        let mut dialog = OwnDialog::new(Asked::Open, "none.obj");
        dialog.enter(folder.path().to_path_buf());
        assert_eq!(dialog.accept(), None);
        assert!(dialog.error.is_some_and(|e| e.contains("none.obj")));
    }

    #[test]
    fn a_folder_is_entered_unless_it_is_asked_for() {
        let folder = tempfile::tempdir().unwrap();
        let inner = folder.path().join("inner");
        std::fs::create_dir(&inner).unwrap();
        for (asked, chosen, now) in [(Asked::Open, None, &*inner), (Asked::Export, Some(inner.clone()), folder.path())]
        {
            let mut dialog = OwnDialog::new(asked, "inner");
            dialog.enter(folder.path().to_path_buf());
            assert_eq!((dialog.accept(), &*dialog.folder), (chosen, now));
        }
    }
}
