//! Carries out the actions of panels and keys.

use glam::Vec3;

use super::action::Action;
use super::dialogs::Asked;
use super::messages::Tone;
use super::state::PlaitApp;
use crate::engine::{ExportOptions, LayoutPreview, Refinement, RegionColour, Source};
use crate::worker::Job;

/// Largest pitch when looking at a place, in radians: seen straight from above, the model is hard to recognise.
const MAX_PITCH: f32 = 1.2;

impl PlaitApp {
    /// Carries out an action.
    pub fn act(&mut self, action: Action, ctx: &egui::Context) {
        match action {
            Action::AskOpen => self.dialogs.ask(Asked::Open, ctx),
            Action::Open(source) => self.worker.request(Job::Open(source)),
            Action::AskSave => self.ask_with_name(Asked::Save, ctx),
            Action::AskExport => self.ask_export(ctx),
            Action::Quads(quads) => self.quads = quads,
            Action::Undo if self.editing.is_some() => self.take_back_anchor(),
            // Undo during a search or an optimisation discards its changes.
            Action::Undo if self.is_optimising() => self.worker.cancel(),
            Action::Undo => self.change(Job::Undo),
            Action::Redo => self.change(Job::Redo),
            Action::Suggest => self.change(Job::Suggest),
            Action::Select(strip) => self.selected = strip,
            Action::Remove(strip) => self.change(Job::Remove(strip)),
            Action::Edit(strip) => self.edit_strip(strip, None),
            Action::PlaceEdited => self.place_edited(),
            Action::StopEditing => self.stop_editing(),
            Action::RemoveAnchor(index) => self.remove_anchor(index),
            Action::SetVisible(strip, visible) => self.worker.request(Job::SetVisible(strip, visible)),
            Action::ChooseDetail(detail) => self.detail = Some(detail),
            Action::ApplyDetail => {
                if let Some(detail) = self.detail {
                    self.change(Job::SetDetail(detail));
                }
            }
            Action::Improve => self.improve(),
            Action::Optimise => self.optimise(),
            Action::Stop => self.worker.stop(),
            Action::SetPinned(part, pinned) => self.worker.request(Job::SetPinned(part, pinned)),
            Action::UnpinAll => {
                let pinned = self.layout().map(LayoutPreview::pinned).unwrap_or_default();
                pinned.into_iter().for_each(|p| self.worker.request(Job::SetPinned(p, false)));
            }
            Action::ChooseColours(mode) => self.chosen_colours = mode,
            Action::FrameAll => self.frame_all(),
            Action::LookAt(place) => self.look_at(place.as_vec3()),
            Action::Toggle(option) => {
                self.options.toggle(option);
                self.camera.z_up = self.options.z_up;
            }
            Action::Cancel => self.worker.cancel(),
            Action::Dismiss(id) => self.messages.dismiss(id),
            Action::Shortcuts(open) => self.shortcuts_open = open,
            Action::About(open) => self.about_open = open,
            Action::Quit => ctx.send_viewport_cmd(egui::ViewportCommand::Close),
        }
    }

    /// Requests a job that changes the strips.
    fn change(&mut self, job: Job) {
        if self.scene.is_some() {
            self.hover.clear();
            self.worker.request(job);
        }
    }

    fn improve(&mut self) {
        if self.can_optimise() {
            self.improvement = None;
            self.change(Job::Improve);
        }
    }

    fn optimise(&mut self) {
        if self.can_optimise() {
            self.hover.clear();
            self.worker.request(Job::Optimise);
        }
    }

    fn ask_with_name(&mut self, asked: Asked, ctx: &egui::Context) {
        let Some(scene) = &self.scene else { return };
        self.dialogs.suggested_name = scene.model.name.clone();
        self.dialogs.ask(asked, ctx);
    }

    /// Asks for the folder of an export, or says why the layout is not valid yet.
    fn ask_export(&mut self, ctx: &egui::Context) {
        let Some(scene) = self.scene.as_deref() else { return };
        if scene.exportable {
            self.ask_with_name(Asked::Export, ctx);
            return;
        }
        let urgent: Vec<_> = scene.remarks.iter().filter(|r| r.colour == RegionColour::Red).collect();
        let reasons: Vec<_> = urgent.iter().map(|r| r.text.as_str()).collect();
        let text = format!("The layout is not valid yet: {}", reasons.join("; "));
        self.messages.add(Tone::Failed, text, urgent.iter().find_map(|r| r.place));
    }

    /// Rotates the camera to look at a place from outside: along the line from the place to the centre of the model.
    fn look_at(&mut self, place: Vec3) {
        let axis = if self.options.z_up { Vec3::new(place.x, place.z, -place.y) } else { place };
        // At the centre there is no such line; the direction of view stays.
        if axis.length() > 1e-4 {
            let d = axis.normalize();
            self.camera.yaw = d.x.atan2(d.z);
            self.camera.pitch = d.y.clamp(-1.0, 1.0).asin().clamp(-MAX_PITCH, MAX_PITCH);
        }
        self.camera.target = place * 0.5;
    }

    /// Requests the jobs of the file dialogs that were confirmed.
    pub(super) fn take_answers(&mut self) {
        for (asked, path) in self.dialogs.answers() {
            match asked {
                Asked::Open => self.worker.request(Job::Open(Source::File(path))),
                Asked::Save => self.worker.request(Job::Save(path)),
                Asked::Export => {
                    let options = ExportOptions { refinement: Refinement::Quads(self.quads) };
                    self.worker.request(Job::Export(path, options));
                }
            }
        }
    }
}
