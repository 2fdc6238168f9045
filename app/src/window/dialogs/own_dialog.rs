//! The file dialog that is shown where the system has none.

use std::path::{Path, PathBuf};

use super::asked::Asked;

/// Our own dialog: the entries of a folder, and a text field for the name.
pub(super) struct OwnDialog {
    pub(super) asked: Asked,
    folder: PathBuf,
    name: String,
    /// The name in the text field when a folder is entered.
    suggested: String,
    entries: Vec<(String, bool)>,
    error: Option<String>,
    /// Whether the text field has been focused.
    focused: bool,
}

impl OwnDialog {
    pub(super) fn new(asked: Asked, name: &str) -> Self {
        let folder = std::env::current_dir().unwrap_or_else(|_| PathBuf::from("/"));
        let (name, suggested) = (name.to_owned(), name.to_owned());
        let mut dialog = Self { asked, folder, name, suggested, entries: Vec::new(), error: None, focused: false };
        dialog.list();
        dialog
    }

    /// Lists the folder: first the sub-folders, then the files that can be chosen.
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
            let extension = Path::new(&name).extension().map(|e| e.to_string_lossy().to_lowercase());
            let known = extension.is_some_and(|e| self.asked.extensions().contains(&e.as_str()));
            if !name.starts_with('.') && (folder || known) {
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
        let name = self.name.trim();
        if name.is_empty() {
            self.error = Some("A name is missing".into());
            return None;
        }
        let path = self.folder.join(name);
        if self.asked != Asked::Export && path.is_dir() {
            self.name.clone_from(&self.suggested);
            self.enter(path);
            return None;
        }
        if self.asked == Asked::Open && !path.is_file() {
            self.error = Some(format!("There is no file {}", path.display()));
            return None;
        }
        if self.asked == Asked::Export && path.is_file() {
            self.error = Some(format!("{} is a file, not a folder", path.display()));
            return None;
        }
        Some(path)
    }

    /// Shows the dialog. `Some(Some(path))`: chosen; `Some(None)`: cancelled.
    pub(super) fn show(&mut self, ctx: &egui::Context) -> Option<Option<PathBuf>> {
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
                ui.colored_label(super::super::theme::BAD, error);
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                if ui.button(self.asked.verb()).clicked() {
                    result = self.accept().map(Some);
                }
                if ui.button("Cancel").clicked() {
                    result = Some(None);
                }
            });
        });
        if result.is_none() && response.should_close() { Some(None) } else { result }
    }

    /// A click selects an entry, a double click enters a folder or accepts a file. A folder is not entered by one click:
    /// the second click of a double click would choose whatever appears there.
    fn list_entries(&mut self, ui: &mut egui::Ui, result: &mut Option<Option<PathBuf>>) {
        let mut accepted = None;
        egui::ScrollArea::vertical().max_height(280.0).auto_shrink([false, false]).show(ui, |ui| {
            for (name, folder) in &self.entries {
                let text = if *folder { format!("{name}/") } else { name.clone() };
                let response = ui.selectable_label(*name == self.name, text);
                if response.clicked() {
                    self.name.clone_from(name);
                }
                if response.double_clicked() {
                    accepted = Some((name.clone(), *folder));
                }
            }
        });
        match accepted {
            Some((name, true)) => {
                self.name.clone_from(&self.suggested);
                self.enter(self.folder.join(name));
            }
            Some((_, false)) => *result = self.accept().map(Some),
            None => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_folders_and_files_that_can_be_chosen_are_listed() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["b.OBJ", "a.plait", "notes.txt", ".hidden.obj"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        std::fs::create_dir(folder.path().join("z")).unwrap();
        let listed = |asked| {
            let mut dialog = OwnDialog::new(asked, "");
            dialog.enter(folder.path().to_path_buf());
            dialog.entries.into_iter().map(|e| e.0).collect::<Vec<_>>()
        };
        assert_eq!(listed(Asked::Open), ["z", "a.plait", "b.OBJ"]);
        // A design is not saved over a mesh.
        assert_eq!(listed(Asked::Save), ["z", "a.plait"]);
        assert_eq!(listed(Asked::Export), ["z"]);
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
    fn a_name_is_needed_and_a_file_is_no_folder_to_export_to() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("file"), "").unwrap();
        for (name, error) in [(" ", "A name is missing"), ("file", "not a folder")] {
            let mut dialog = OwnDialog::new(Asked::Export, name);
            dialog.enter(folder.path().to_path_buf());
            assert_eq!(dialog.accept(), None);
            assert!(dialog.error.is_some_and(|e| e.contains(error)));
        }
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
