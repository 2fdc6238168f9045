//! Colours, spacing and font sizes of the window: light, with one accent colour.

use egui::{Color32, CornerRadius, FontFamily, FontId, Shadow, Stroke, TextStyle, Visuals, vec2};

/// Background of panels.
pub const PANEL: Color32 = Color32::from_rgb(0xf8, 0xf7, 0xf5);
/// Background of menu bar and status bar.
pub const BAR: Color32 = Color32::from_rgb(0xf0, 0xef, 0xec);
/// Background of cards, menus and buttons.
pub const RAISED: Color32 = Color32::from_rgb(0xff, 0xff, 0xff);
/// Thin lines.
pub const LINE: Color32 = Color32::from_rgb(0xdf, 0xdc, 0xd6);
/// Text.
pub const TEXT: Color32 = Color32::from_rgb(0x1d, 0x1f, 0x23);
/// Secondary text.
pub const QUIET: Color32 = Color32::from_rgb(0x63, 0x66, 0x6c);
/// The accent colour.
pub const ACCENT: Color32 = Color32::from_rgb(0x1f, 0x5f, 0xd0);
/// Background of selected items.
pub const ACCENT_WASH: Color32 = Color32::from_rgb(0xe3, 0xec, 0xfb);
/// Text about success.
pub const GOOD: Color32 = Color32::from_rgb(0x15, 0x86, 0x43);
/// Text about errors.
pub const BAD: Color32 = Color32::from_rgb(0xb9, 0x2d, 0x29);

/// Applies the theme; to be called once at the start.
pub fn apply(ctx: &egui::Context) {
    ctx.set_theme(egui::Theme::Light);
    // The dark style too, so that both look the same.
    ctx.all_styles_mut(|style| {
        let font = |size| FontId::new(size, FontFamily::Proportional);
        style.text_styles = [
            (TextStyle::Small, font(12.0)),
            (TextStyle::Body, font(14.0)),
            (TextStyle::Button, font(14.0)),
            (TextStyle::Heading, font(17.0)),
            (TextStyle::Monospace, FontId::new(13.0, FontFamily::Monospace)),
        ]
        .into();
        style.spacing.item_spacing = vec2(8.0, 6.0);
        style.spacing.button_padding = vec2(10.0, 5.0);
        style.spacing.interact_size.y = 26.0;
        style.spacing.window_margin = egui::Margin::same(16);
        style.interaction.selectable_labels = false;
        style.visuals = visuals();
    });
}

fn visuals() -> Visuals {
    let mut v = Visuals::light();
    let radius = CornerRadius::same(6);
    v.panel_fill = PANEL;
    v.window_fill = RAISED;
    v.window_stroke = Stroke::new(1.0, LINE);
    v.window_corner_radius = CornerRadius::same(10);
    v.menu_corner_radius = CornerRadius::same(8);
    let shadow = |blur| Shadow { offset: [0, 4], blur, spread: 0, color: Color32::from_black_alpha(36) };
    v.window_shadow = shadow(22);
    v.popup_shadow = shadow(14);
    v.override_text_color = None;
    v.weak_text_color = Some(QUIET);
    v.extreme_bg_color = RAISED;
    v.faint_bg_color = Color32::from_rgb(0xf1, 0xf0, 0xed);
    v.hyperlink_color = ACCENT;
    v.selection.bg_fill = ACCENT_WASH;
    v.selection.stroke = Stroke::new(1.0, ACCENT);
    v.warn_fg_color = Color32::from_rgb(0xa8, 0x62, 0x00);
    v.error_fg_color = BAD;
    let w = &mut v.widgets;
    for (state, fill, line) in [
        (&mut w.noninteractive, PANEL, LINE),
        (&mut w.inactive, RAISED, Color32::from_rgb(0xd3, 0xd0, 0xc9)),
        (&mut w.hovered, Color32::from_rgb(0xf2, 0xf6, 0xfd), Color32::from_rgb(0x9f, 0xbb, 0xea)),
        (&mut w.active, ACCENT_WASH, ACCENT),
        (&mut w.open, ACCENT_WASH, Color32::from_rgb(0x9f, 0xbb, 0xea)),
    ] {
        state.bg_fill = fill;
        state.weak_bg_fill = fill;
        state.bg_stroke = Stroke::new(1.0, line);
        state.fg_stroke = Stroke::new(1.0, TEXT);
        state.corner_radius = radius;
        state.expansion = 0.0;
    }
    v
}
