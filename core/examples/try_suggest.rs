#![allow(missing_docs)]
use plait_core::{mesh, progress::Progress, weave::*};
use std::time::Instant;
fn main() {
    let p = Progress::new();
    for path in std::env::args().skip(1) {
        let t0 = Instant::now();
        let src = MeshSource::from_name(&path);
        let loaded = match src.load(std::path::Path::new(".")) {
            Ok(l) => l,
            Err(e) => {
                println!("{path}: REFUSED {e}");
                continue;
            }
        };
        let nf = loaded.mesh.n_faces();
        let mut s = match Session::open(loaded, src, Options::default(), &p) {
            Ok(s) => s,
            Err(e) => {
                println!("{path}: OPEN {e}");
                continue;
            }
        };
        let t1 = t0.elapsed().as_secs_f64();
        let mut n = 0;
        let goal = if std::env::var("ORANGE").is_ok() { Goal::Separated } else { Goal::Valid };
        let verbose = std::env::var("V").is_ok();
        let end = loop {
            let t = Instant::now();
            match s.suggest(goal, &p) {
                Ok(pr) => {
                    let c = pr.cost;
                    let l = pr.curve.length(&s.model().mesh);
                    let closed = pr.curve.closed;
                    if let Err(e) = s.place(pr, &p) {
                        break format!("PLACE {e}");
                    };
                    n += 1;
                    if verbose {
                        println!(
                            "   {n}: cost {c:.2} len {l:.2} closed {closed} red {} orange {} regions {} crossings {} {:.2}s",
                            s.woven().red().len(),
                            s.woven().count(plait_core::dual::Colour::Orange),
                            s.woven().arrangement.regions.len(),
                            s.woven().arrangement.crossings.len(),
                            t.elapsed().as_secs_f64()
                        );
                    }
                }
                Err(e) => break e.to_string(),
            }
            if n > 80 || t0.elapsed().as_secs() > 120 {
                break "LIMIT".into();
            }
        };
        let t2 = t0.elapsed().as_secs_f64();
        let out = std::path::PathBuf::from("/tmp/out").join(std::path::Path::new(&path).file_stem().unwrap());
        let r = write_all(&s, &ExportOptions::default(), &out, Default::default(), &p);
        let t3 = t0.elapsed().as_secs_f64();
        match r {
            Ok(Ok(e)) => println!(
                "{path}: {nf}f genus {} corners {} strips {n} patches {} irr {} red {} orange {} yellow {} flips {} quads {} | open {t1:.1} weave {:.1} export {:.1} | {end}",
                s.model().topology.genus,
                s.model().corners.len(),
                e.layout.patches.len(),
                e.layout.n_irregular(),
                s.woven().red().len(),
                s.woven().count(plait_core::dual::Colour::Orange),
                s.woven().count(plait_core::dual::Colour::Yellow),
                e.maps.iter().map(|m| m.flipped).sum::<usize>(),
                e.quads.quads.len(),
                t2 - t1,
                t3 - t2
            ),
            Ok(Err(e)) => println!(
                "{path}: {nf}f corners {} strips {n} NOT VALID {e} red {} | open {t1:.1} weave {:.1} | {end}",
                s.model().corners.len(),
                s.woven().red().len(),
                t2 - t1
            ),
            Err(e) => println!("{path}: ERR {e}"),
        }
    }
    let _ = mesh::builtin_names();
}
