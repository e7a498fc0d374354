//! How many roles are right, and how far the confidence that they are given with can be trusted: on the labeled rigs as they are,
//! without names, with names that mislead, in other languages, in other shapes, and with joints that are missing.

use std::collections::BTreeMap;

use retargetd::rig::{Hints, Part, RigKind, Role, Side, recognize};

use super::{
    spoken::LANGUAGES,
    stripped::samples,
    varied::{ARM, COUNTED, LEG, Labeled, labeled},
};
use crate::made_animals::Random;

/// Seeds of what is held begin here.
const HELD_SEEDS: u64 = 1_000_000;

#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    rigs: usize,
    no_body: usize,
    all: usize,
    right: usize,
    /// Roles given with at least 0.9 and 0.8, and those of them that are right.
    sure: [usize; 2],
    sure_right: [usize; 2],
}

/// The tallies of every kind of change, on files to tune on and on files that are held.
#[derive(Default)]
struct Table {
    rows: BTreeMap<(&'static str, bool), Tally>,
    wrong: Vec<String>,
}

impl Table {
    fn add(&mut self, kind: &'static str, rig: &Labeled) {
        let (skeleton, rest) = rig.skeleton();
        let seen = recognize(&skeleton, &rest, &Hints::default());
        let tally = self.rows.entry((kind, rig.is_held)).or_default();
        tally.rigs += 1;
        tally.no_body += usize::from(seen.kind != RigKind::Biped);
        let is_right = |role: &Role, joints: &[usize]| {
            let truth = rig.truth.get(role);
            truth.is_some_and(|truth| {
                if role.part == Part::Spine && kind == "as they are" { truth == joints } else { truth[0] == joints[0] }
            })
        };
        let mut note = |what: String| self.wrong.push(format!("{kind}: {}: {what}", rig.path));
        for (role, joints) in &rig.truth {
            tally.all += 1;
            match seen.roles.get(role) {
                Some(finding) if is_right(role, &finding.joints) => tally.right += 1,
                Some(finding) => note(format!(
                    "{role} is {} at {:.2}, not {}",
                    rig.bones[finding.joints[0]].name, finding.confidence, rig.bones[joints[0]].name
                )),
                None => note(format!("{role} is nothing, not {}", rig.bones[joints[0]].name)),
            }
        }
        for (role, finding) in seen.roles.iter().filter(|(role, _)| COUNTED.contains(&role.part)) {
            for (place, least) in [0.9, 0.8].into_iter().enumerate() {
                if finding.confidence >= least {
                    tally.sure[place] += 1;
                    tally.sure_right[place] += usize::from(is_right(role, &finding.joints));
                }
            }
            if finding.confidence >= 0.8 && !rig.truth.contains_key(role) {
                note(format!(
                    "{role} is invented as {} at {:.2}",
                    rig.bones[finding.joints[0]].name, finding.confidence
                ));
            }
        }
    }

    fn add_all(&mut self, rig: &Labeled, seeds: u64) {
        let random = |seed: u64| Random(if rig.is_held { HELD_SEEDS + seed } else { seed });
        self.add("as they are", rig);
        self.add("stripped", &rig.clone().without_names());
        for (kind, parts, step) in [
            ("leg names one on", LEG, 1),
            ("leg names one back", LEG, -1),
            ("arm names one on", ARM, 1),
            ("arm names one back", ARM, -1),
        ] {
            self.add(kind, &rig.clone().shifted(parts, step));
        }
        for seed in 0..seeds {
            self.add("leg names shuffled", &rig.clone().shuffled(LEG, &mut random(seed)));
            self.add("arm names shuffled", &rig.clone().shuffled(ARM, &mut random(seed)));
            self.add("reshaped", &rig.clone().reshaped(&mut random(seed)));
            self.add("reshaped, stripped", &rig.clone().reshaped(&mut random(seed)).without_names());
            self.add("helpers", &rig.clone().with_helpers(&mut random(seed)));
            self.add("helpers, stripped", &rig.clone().with_helpers(&mut random(seed)).without_names());
        }
        let lacking: [(&'static str, Part, bool, bool); 9] = [
            ("no clavicles", Part::Clavicle, true, false),
            ("no neck", Part::Neck, false, false),
            ("no toes", Part::Toe, true, true),
            ("no hands", Part::Hand, true, true),
            ("no thighs", Part::Thigh, true, false),
            ("no shins", Part::Shin, true, false),
            ("no upper arms", Part::UpperArm, true, false),
            ("no forearms", Part::Forearm, true, false),
            ("no left leg", Part::Thigh, false, true),
        ];
        for (kind, part, is_paired, with_all_below) in lacking {
            let sides: &[Side] = match (part, is_paired) {
                (Part::Neck, _) => &[Side::Center],
                (_, true) => &Side::BOTH,
                (_, false) => &[Side::Left],
            };
            if let Some(rig) = rig.clone().lacking(sides, part, with_all_below) {
                self.add(kind, &rig);
            }
        }
        for language in LANGUAGES {
            self.add(language.name, &rig.clone().translated(language));
        }
    }

    /// The sum of all rows that are held or not.
    fn sum(&self, is_held: bool) -> Tally {
        let rows = self.rows.iter().filter(|((_, held), _)| *held == is_held);
        rows.fold(Tally::default(), |sum, (_, row)| Tally {
            rigs: sum.rigs + row.rigs,
            no_body: sum.no_body + row.no_body,
            all: sum.all + row.all,
            right: sum.right + row.right,
            sure: [0, 1].map(|place| sum.sure[place] + row.sure[place]),
            sure_right: [0, 1].map(|place| sum.sure_right[place] + row.sure_right[place]),
        })
    }

    fn lines(&self) -> String {
        let line = |what: &str, is_held: bool, row: &Tally| {
            let share = |part: usize, whole: usize| 100.0 * part as f64 / whole.max(1) as f64;
            format!(
                "{what:28} {:4} rigs {:5} {:3} no body  right {:6.2} %  at 0.9: {:6} {:7.3} %  at 0.8: {:6} {:7.3} %",
                if is_held { "held" } else { "tune" },
                row.rigs,
                row.no_body,
                share(row.right, row.all),
                row.sure[0],
                share(row.sure_right[0], row.sure[0]),
                row.sure[1],
                share(row.sure_right[1], row.sure[1]),
            )
        };
        let mut lines: Vec<String> = self.rows.iter().map(|((what, held), row)| line(what, *held, row)).collect();
        lines.extend([false, true].map(|held| line("all", held, &self.sum(held))));
        lines.join("\n")
    }
}

#[test]
#[ignore = "the long form: every labeled rig in every change; prints the table"]
#[expect(clippy::print_stdout, reason = "the table is for people, who ask for it")]
fn long_form() {
    let rigs = labeled(&samples());
    let mut table = Table::default();
    for rig in &rigs {
        table.add_all(rig, 3);
    }
    for line in &table.wrong {
        let is_held = rigs.iter().any(|rig| rig.is_held && line.contains(&rig.path));
        println!("{} {line}", if is_held { "held" } else { "tune" });
    }
    println!("{}", table.lines());
}

/// The short form: what must hold on every labeled rig as it is, and on those without names and with shifted names.
#[test]
fn what_is_sure_is_right() {
    let rigs = labeled(&samples());
    let mut table = Table::default();
    for rig in &rigs {
        table.add("as they are", rig);
        table.add("stripped", &rig.clone().without_names());
        table.add("leg names one on", &rig.clone().shifted(LEG, 1));
        table.add("arm names one back", &rig.clone().shifted(ARM, -1));
        table.add("French", &rig.clone().translated(&LANGUAGES[0]));
    }
    let of = |kind: &str| {
        let rows = table.rows.iter().filter(|((row, _), _)| *row == kind);
        rows.fold((0, 0), |sum, (_, row)| (sum.0 + row.right, sum.1 + row.all))
    };
    let share = |(right, all): (usize, usize)| if all == 0 { 1.0 } else { right as f64 / all as f64 };
    let lines = table.lines();
    assert!(share(of("as they are")) >= 1.0, "{lines}");
    assert!(share(of("stripped")) >= 0.95, "without names:\n{lines}");
    let stripped = table.rows.iter().filter(|((row, _), _)| *row == "stripped").map(|(_, row)| row);
    for row in stripped {
        assert_eq!(row.sure_right[1], row.sure[1], "without names, what is given at 0.8 is right:\n{lines}");
    }
    for kind in ["leg names one on", "arm names one back"] {
        assert!(share(of(kind)) >= 0.95, "{kind}:\n{lines}");
    }
    assert!(share(of("French")) >= 0.99, "{lines}");
    let sure = |kind: &str| {
        let rows = table.rows.iter().filter(|((row, _), _)| *row == kind);
        rows.fold((0, 0), |sum, (_, row)| (sum.0 + row.sure_right[0], sum.1 + row.sure[0]))
    };
    for kind in ["leg names one on", "arm names one back"] {
        assert!(share(sure(kind)) >= 0.99, "{kind}: what is given at 0.9 is right:\n{lines}");
    }
    let all = [false, true].map(|held| table.sum(held));
    let all = (all[0].sure_right[0] + all[1].sure_right[0], all[0].sure[0] + all[1].sure[0]);
    assert!(share(all) >= 0.995, "what is given at 0.9 is right:\n{lines}");
}
