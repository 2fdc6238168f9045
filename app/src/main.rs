//! Plait.
fn main() {
    let arg = std::env::args().nth(1);
    let source = arg.map(|a| plait_app::engine::Source::File(a.into()));
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default().with_inner_size([1440.0, 900.0]).with_title("Plait"),
        ..Default::default()
    };
    let opener = std::sync::Arc::new(plait_app::demo::DemoOpener);
    eframe::run_native(
        "plait",
        options,
        Box::new(move |cc| Ok(Box::new(plait_app::window::PlaitApp::new(cc, opener, source)?))),
    )
    .unwrap();
}
