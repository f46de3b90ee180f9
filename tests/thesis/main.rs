//! The printed numbers of a thesis against converged ones: `docs/thesis.md` is what this program gives. With the environment variable
//! `BLESS` set, the page is written anew.

mod adhesion;
mod aspiration;
#[path = "../common/mod.rs"]
mod common;
mod indentation;
mod page;
mod solve;

use page::{Chapter, Content, Entry, Verdict, digits, page};
use rayon::prelude::*;
use std::sync::LazyLock;

const PAGE: &str = "docs/thesis.md";

/// Chapter 4 as the thesis has it.
const CONES: indentation::Cones = indentation::Cones { r0: 2.0, height: 0.4 };

/// All that is judged, solved once.
static CHAPTERS: LazyLock<Vec<Chapter>> = LazyLock::new(|| {
    let all: [fn() -> Chapter; 4] = [
        indentation::chapter3,
        || CONES.chapter(),
        || aspiration::chapter5(2.0),
        || adhesion::Charged { r0: 1.2 }.chapter(),
    ];
    all.par_iter().with_max_len(1).map(|chapter| chapter()).collect()
});

#[test]
fn the_page_is_what_the_program_gives() {
    let text = page(&CHAPTERS);
    assert!(text.is_ascii());
    if std::env::var_os("BLESS").is_some() {
        std::fs::write(PAGE, &text).unwrap();
    }
    let committed = std::fs::read_to_string(PAGE).unwrap();
    for (computed, committed) in text.lines().zip(committed.lines()) {
        assert_eq!(computed, committed, "{PAGE} is not what is computed; with BLESS=1 this test rewrites it");
    }
    assert_eq!(text, committed);
}

#[test]
fn every_row_of_the_list_is_there() {
    let rows: Vec<&str> = CHAPTERS.iter().flat_map(|c| &c.entries).map(|e| e.row).collect();
    for row in 1..=78 {
        assert!(rows.contains(&row.to_string().as_str()), "row {row}");
    }
    for chapter in &*CHAPTERS {
        let numbered: Vec<u32> = chapter.entries.iter().filter_map(|e| e.row.parse().ok()).collect();
        assert!(numbered.is_sorted(), "{}: {numbered:?}", chapter.title);
    }
}

/// The verdict on the first line of a row.
fn verdict(row: &str) -> Verdict {
    let entry = CHAPTERS.iter().flat_map(|c| &c.entries).find(|e| e.row == row);
    entry.unwrap_or_else(|| panic!("no row {row}")).verdict()
}

#[test]
fn the_findings_of_the_introduction_are_those_of_the_table() {
    for row in ["14", "67", "69"] {
        assert_eq!(verdict(row), Verdict::Holds, "row {row}");
    }
    for row in ["13", "15", "48"] {
        assert!(matches!(verdict(row), Verdict::Other(_)), "row {row}");
    }
    let failing = ["7", "8", "9", "10", "16", "27", "28", "29", "34", "39", "43", "65", "66", "68", "75", "76", "77"];
    for row in failing {
        assert!(matches!(verdict(row), Verdict::Fails(_)), "row {row}");
    }
    let forces = CHAPTERS[1].entries.iter().find(|e| e.row == "10").unwrap();
    assert!(forces.line().contains("3 of 4 met"), "{}", forces.line());
}

/// The judged numbers, without claims.
fn judged() -> impl Iterator<Item = &'static Entry> {
    CHAPTERS.iter().flat_map(|c| &c.entries).filter(|e| matches!(e.content, Content::Numbers { .. }))
}

/// An entry with other printed numbers.
fn printed(entry: &Entry, change: impl Fn(usize, &str) -> String) -> Entry {
    let mut entry = entry.clone();
    if let Content::Numbers { printed, .. } = &mut entry.content {
        *printed = printed.iter().enumerate().map(|(i, p)| change(i, p)).collect();
    }
    entry
}

// The twins: what must change if a printed number, or what is computed, were another.

#[test]
fn a_verdict_turns_with_the_printed_number() {
    let (mut held, mut failed) = (0, 0);
    for entry in judged() {
        let Content::Numbers { readings, .. } = &entry.content else { continue };
        if entry.verdict() == Verdict::Holds {
            let moved = printed(entry, |i, _| digits(1.02 * readings[0].values[i].unwrap(), 6));
            assert_ne!(moved.verdict(), Verdict::Holds, "{moved:?}");
            held += 1;
        } else if readings[0].values.iter().all(Option::is_some) {
            let met = printed(entry, |i, _| digits(readings[0].values[i].unwrap(), 5));
            assert_eq!(met.verdict(), Verdict::Holds, "{met:?}");
            failed += 1;
        }
    }
    assert!(held >= 5 && failed >= 15, "{held}, {failed}");
}

#[test]
fn the_page_shows_a_thousandth_of_a_printed_number() {
    for entry in judged() {
        let moved = printed(entry, |_, p| digits(1.001 * p.parse::<f64>().unwrap(), 6));
        assert_ne!(moved.line(), entry.line());
    }
}

#[test]
fn the_page_shows_a_thousandth_of_a_parameter() {
    let chapter = &CHAPTERS[1];
    let changed = |other: &Chapter, rows: &[&str]| {
        for (a, b) in chapter.entries.iter().zip(&other.entries).filter(|(a, _)| rows.contains(&a.row)) {
            assert_ne!(a.line(), b.line());
        }
    };
    changed(&indentation::Cones { r0: 2.002, ..CONES }.chapter(), &["9", "13"]);
    let other = indentation::Cones { height: 0.4004, ..CONES }.chapter();
    changed(&other, &["9", "10", "14"]);
    // And nothing else moves: it is the same program.
    for (a, b) in
        chapter.entries.iter().zip(&other.entries).filter(|(a, _)| ["7", "8", "15", "16", "22"].contains(&a.row))
    {
        assert_eq!(a.line(), b.line());
    }
}
