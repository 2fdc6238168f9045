//! The real window on a virtual screen, driven by a pointer and keys.

mod support;

use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use image::RgbImage;

/// Longest wait for the window; a busy machine without a GPU takes some seconds.
const PATIENCE: Duration = Duration::from_secs(180);

/// A process that is ended with the test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        drop(self.0.kill());
        drop(self.0.wait());
    }
}

/// A virtual screen, and what can be done on it.
struct Screen {
    _server: Running,
    display: String,
    folder: tempfile::TempDir,
}

impl Screen {
    /// `None` where a tool is missing.
    fn open() -> Option<Self> {
        for tool in ["Xvfb", "xdotool", "import"] {
            if Command::new(tool).arg("-version").stdout(Stdio::null()).stderr(Stdio::null()).status().is_err() {
                support::skip(&format!("there is no {tool} (packages xvfb, xdotool, imagemagick)"));
                return None;
            }
        }
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "1280x800x24", "-nolisten", "tcp"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        // The server writes its number once it can be talked to.
        let mut number = String::new();
        BufReader::new(server.stdout.take().unwrap()).read_line(&mut number).unwrap();
        let display = format!(":{}", number.trim());
        Some(Self { _server: Running(server), display, folder: tempfile::tempdir().unwrap() })
    }

    fn command(&self, program: impl AsRef<std::ffi::OsStr>) -> Command {
        let mut command = Command::new(program);
        command.env("DISPLAY", &self.display).env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
        command
    }

    fn xdotool(&self, arguments: &str) -> String {
        let output = self.command("xdotool").args(arguments.split(' ')).output().unwrap();
        String::from_utf8_lossy(&output.stdout).trim().to_owned()
    }

    fn picture(&self) -> RgbImage {
        let path = self.folder.path().join("screen.png");
        let shot = self.command("import").args(["-window", "root"]).arg(&path).status().unwrap();
        assert!(shot.success(), "no picture of the screen");
        image::open(&path).unwrap().to_rgb8()
    }

    /// Waits until three pictures in a row are the same and differ from `before` by many pixels.
    fn steady(&self, before: &RgbImage) -> RgbImage {
        let mut last = self.picture();
        let mut same = 0;
        wait_for("the screen to change and rest", || {
            std::thread::sleep(Duration::from_millis(300));
            let now = self.picture();
            same = if now == last { same + 1 } else { 0 };
            last = now;
            same >= 2 && different(&last, before) > 500
        });
        last
    }
}

fn wait_for(what: &str, mut done: impl FnMut() -> bool) {
    let start = Instant::now();
    while !done() {
        assert!(start.elapsed() < PATIENCE, "waited too long for {what}");
        std::thread::sleep(Duration::from_millis(100));
    }
}

fn different(a: &RgbImage, b: &RgbImage) -> usize {
    a.pixels().zip(b.pixels()).filter(|(a, b)| a != b).count()
}

#[test]
fn strips_are_placed_and_undone_in_the_real_window() {
    let Some(screen) = Screen::open() else { return };
    let errors = screen.folder.path().join("errors.txt");
    let mut program = Running(
        screen
            .command(Path::new(env!("CARGO_BIN_EXE_plait")))
            .arg("torus")
            .stderr(std::fs::File::create(&errors).unwrap())
            .spawn()
            .unwrap(),
    );
    let mut window = String::new();
    wait_for("the window", || {
        assert!(program.0.try_wait().unwrap().is_none(), "{}", std::fs::read_to_string(&errors).unwrap());
        window = screen.xdotool("search --onlyvisible --name ^Plait");
        !window.is_empty()
    });
    screen.xdotool("mousemove 20 700");
    screen.xdotool(&format!("windowfocus --sync {}", window.lines().next().unwrap()));
    let empty = screen.steady(&RgbImage::new(1280, 800));

    screen.xdotool("key s");
    let one = screen.steady(&empty);
    screen.xdotool("key s");
    let two = screen.steady(&one);
    screen.xdotool("key ctrl+z");
    let again = screen.steady(&two);
    assert!(different(&again, &one) < different(&again, &two), "undo does not show what was there before");

    screen.xdotool("key ctrl+q");
    let mut code = None;
    wait_for("the program to end", || {
        code = program.0.try_wait().unwrap();
        code.is_some()
    });
    assert!(code.unwrap().success(), "{}", std::fs::read_to_string(&errors).unwrap());
}
