use membrane::{model, run, spec};
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let mut doc = match spec::Document::load(&args[1], None) {
        Ok(d) => d,
        Err(r) => {
            for d in &r.diagnostics {
                println!("{d:?}");
            }
            std::process::exit(2)
        }
    };
    let mut req = vec![];
    for a in &args[2..] {
        let (k, v) = a.split_once('=').unwrap();
        if let Some(k) = k.strip_prefix('@') {
            req.push(run::Request { name: k.into(), value: v.parse().unwrap() });
        } else {
            doc = model::set(&doc, k, v).map_err(|e| e.1).unwrap();
        }
    }
    let m = match model::resolve(&doc.problem) {
        Ok(m) => m,
        Err(e) => {
            for d in e {
                println!("{d:?}");
            }
            std::process::exit(2)
        }
    };
    let out = run::run(&m, &req, &mut |_, _| std::ops::ControlFlow::Continue(()));
    for p in &out.points {
        let s = &p.solution;
        print!(
            "{:?} it {} f {} n {} cpu {:.1}us | ",
            p.reason,
            p.work.effort.iterations,
            p.work.effort.factorisations,
            p.work.intervals,
            p.work.cpu_seconds * 1e6
        );
        for (q, v) in m.quantities.iter().zip(&s.quantities) {
            if let Some(v) = v {
                print!("{} {:.13} ({:.1e}) ", q.name, v.value, v.error / v.value.abs());
            }
        }
        println!(
            "fi {:.1e} fb {:.1e} vw {:.1e} id {:.1e} {:?}",
            s.certificate.first_integral,
            s.certificate.force_balance,
            s.certificate.virtual_work,
            s.certificate.identities,
            s.certificate.violations
        );
    }
    println!("{:?}", out.status);
}
