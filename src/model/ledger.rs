//! The ledger: every unknown and every condition, with its name and where it comes from.

use crate::bvp::Problem as _;
use crate::diagnostic::Diagnostic;
use crate::spec::Problem;
use crate::system::System;

/// One line of the ledger.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Name.
    pub name: String,
    /// The equation that is solved (conditions), or what the unknown is.
    pub text: String,
    /// The element or block of the file that brings it.
    pub origin: String,
}

/// All unknowns (states of segments count once each) and all conditions.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ledger {
    /// The unknowns.
    pub unknowns: Vec<Entry>,
    /// The conditions, in the order of the system, the branch last.
    pub conditions: Vec<Entry>,
}

impl Ledger {
    pub(super) fn unknown(&mut self, name: String, text: String, origin: String) {
        self.unknowns.push(Entry { name, text, origin });
    }

    pub(super) fn condition(&mut self, name: String, text: String, origin: String) {
        self.conditions.push(Entry { name, text, origin });
    }

    /// Refuses a count that does not close.
    pub(super) fn check(&self, problem: &Problem, system: &System, errors: &mut Vec<Diagnostic>) {
        let (unknowns, conditions) = (self.unknowns.len(), self.conditions.len());
        debug_assert_eq!(unknowns, system.layout().conditions());
        if unknowns == conditions {
            return;
        }
        let few = conditions < unknowns;
        let (code, message) = if few {
            let n = unknowns - conditions;
            ("count-too-few", format!("{unknowns} unknowns, but only {conditions} conditions: {n} missing"))
        } else {
            let n = conditions - unknowns;
            ("count-too-many", format!("{conditions} conditions for only {unknowns} unknowns: {n} too many"))
        };
        let mut d = Diagnostic::error(code, message);
        if !problem.constraints.is_empty() && !few {
            d = d.at("/constraints", "conditions of the file");
        } else if problem.unknowns.len() > 1 && few {
            d = d.at("/unknowns", "unknowns of the file");
        } else {
            d = d.at("/meridian", "the conditions of ends and joints are implied by this list");
        }
        let list = |entries: &[Entry]| entries.iter().map(|e| e.name.as_str()).collect::<Vec<_>>().join("; ");
        d = d.help(format!("unknowns: {}", list(&self.unknowns)));
        d = d.help(format!("conditions: {}", list(&self.conditions)));
        d = d.help(if few {
            if problem.fluid.is_none() && problem.initial != crate::spec::Initial::Unloaded {
                "a fluid brings p_f and one condition; or fix an unknown by an equation among the constraints"
                    .to_owned()
            } else {
                "fix an unknown by an equation among the constraints, or make it a parameter".to_owned()
            }
        } else {
            let last = self.conditions.iter().filter(|c| c.origin == "constraint").map(|c| format!("`{}`", c.name));
            let last: Vec<String> = last.collect();
            if last.is_empty() {
                "declare the quantity that the extra condition determines among the unknowns".to_owned()
            } else {
                format!("remove {} or declare what it determines among the unknowns", last.join(" or "))
            }
        });
        errors.push(d);
    }
}
