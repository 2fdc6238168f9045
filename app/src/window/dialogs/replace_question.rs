//! The question whether files are replaced.

use std::path::{Path, PathBuf};

use super::asked::Asked;

/// The answer to the question.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Decision {
    /// The files are replaced.
    Replace,
    /// The files are kept, and nothing is written.
    Keep,
}

/// The question whether files are replaced by what is written.
#[derive(Debug)]
pub(super) struct ReplaceQuestion {
    /// What is written.
    pub(super) asked: Asked,
    /// Where it is written.
    pub(super) path: PathBuf,
    /// The files that are there.
    files: Vec<PathBuf>,
}

impl ReplaceQuestion {
    pub(super) fn new(asked: Asked, path: PathBuf, files: Vec<PathBuf>) -> Self {
        Self { asked, path, files }
    }

    fn heading(&self) -> String {
        match &*self.files {
            [file] => format!("Replace {}?", name(file)),
            files => format!("Replace {} files?", files.len()),
        }
    }

    /// The folder, and the names of several files.
    fn details(&self) -> String {
        let folder = self.files.first().and_then(|f| f.parent()).map(|p| p.display().to_string()).unwrap_or_default();
        match &*self.files {
            [_] => format!("There is a file of this name in {folder}. Its contents will be lost."),
            files => {
                let names: Vec<String> = files.iter().map(name).collect();
                format!("The contents of {} in {folder} will be lost.", names.join(", "))
            }
        }
    }

    /// Shows the question. Enter and Escape keep the files.
    pub(super) fn show(&self, ctx: &egui::Context) -> Option<Decision> {
        let mut decision = None;
        let frame = egui::Frame::window(&ctx.global_style()).inner_margin(18.0);
        let response = egui::Modal::new(egui::Id::unique("replace question")).frame(frame).show(ctx, |ui| {
            ui.set_width(420.0);
            ui.heading(self.heading());
            ui.label(self.details());
            ui.add_space(8.0);
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let keep = ui.button("Cancel");
                if ui.memory(|m| m.focused().is_none()) {
                    keep.request_focus();
                }
                if keep.clicked() {
                    decision = Some(Decision::Keep);
                }
                if ui.button("Replace").clicked() {
                    decision = Some(Decision::Replace);
                }
            });
        });
        if decision.is_none() && response.should_close() { Some(Decision::Keep) } else { decision }
    }
}

fn name(file: impl AsRef<Path>) -> String {
    file.as_ref().file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_question_names_the_files_and_their_folder() {
        let one = ReplaceQuestion::new(Asked::Save, "/x/a.plait".into(), vec!["/x/a.plait".into()]);
        assert_eq!(one.heading(), "Replace a.plait?");
        assert!(one.details().contains("/x."), "{}", one.details());
        let two = ReplaceQuestion::new(Asked::Export, "/x".into(), vec!["/x/a.obj".into(), "/x/b.obj".into()]);
        assert_eq!(two.heading(), "Replace 2 files?");
        assert!(two.details().contains("a.obj, b.obj in /x"), "{}", two.details());
    }
}
