//! The conditions of ends and joints.
//!
//! Those of the catalogue are put together as formulas, with the text that says the same in the words of a file; those that the file
//! writes itself are read like any other equation. Both go into the system and the ledger in the same order.

use super::rigid::{Rigid, RigidEdge};
use crate::diagnostic::Diagnostic;
use crate::expr::{Builder, ExprError, Node};
use crate::model::ledger::Ledger;
use crate::model::names::{Binder, Names};
use crate::model::stage::pull;
use crate::model::{Adhesion, Grip, bracket, token};
use crate::physics::surface::Generator;
use crate::spec::{Equation, Formula, KinkLaw, Number};
use crate::system::{Coordinate, Field, Kind, Side, System};
use indexmap::IndexMap;
use std::f64::consts::PI;

/// Puts a formula together.
type Make<'m> = dyn Fn(&mut Builder, &mut Binder) -> Result<Node, Vec<ExprError>> + 'm;

/// A sharp edge over which the membrane is bent.
#[derive(Clone, Copy)]
pub(super) struct Bend<'b> {
    pub(super) name: &'b str,
    pub(super) body: usize,
    pub(super) edge: &'b RigidEdge,
    /// The bodies and faces on which the membrane lies before and after it.
    pub(super) sides: [Option<(usize, usize)>; 2],
    /// The material angle that touched it first.
    pub(super) phi: f64,
    /// How it holds the membrane, where it has friction.
    pub(super) grip: Grip,
}

/// Where the conditions go.
pub(super) struct Conditions<'w, 'a> {
    pub(super) system: &'w mut System,
    pub(super) ledger: &'w mut Ledger,
    pub(super) names: &'w mut Names<'a>,
    pub(super) errors: &'w mut Vec<Diagnostic>,
}

impl Conditions<'_, '_> {
    /// A condition of the catalogue.
    fn add(&mut self, name: String, text: String, origin: &str, make: &Make<'_>) {
        if let Some(f) = self.names.build(self.system, true, make) {
            self.system.conditions.push(f);
        }
        self.ledger.condition(name, text, origin.to_owned());
    }

    /// An equation, with the place of its mistakes.
    fn read(&mut self, name: String, text: &str, origin: &str, at: &str) {
        if let Some(f) = self.names.equation(self.system, text, at, true, self.errors) {
            self.system.conditions.push(f);
            self.ledger.condition(name, text.to_owned(), origin.to_owned());
        }
    }

    /// A field at an end of a piece has a value.
    fn fixed(&mut self, piece: usize, side: Side, field: Field, value: f64, [name, text, origin]: [String; 3]) {
        self.add(name, text, &origin, &|b, x| {
            let (field, value) = (x.end(b, piece, side, field), b.constant(value));
            Ok(b.sub(field, value))
        });
    }

    /// A pole at an end of a piece.
    pub(super) fn pole(&mut self, i: usize, side: Side) {
        let piece = self.system.pieces[i].clone();
        let end = format!("{}.{}", piece.name, if side == Side::Start { "start" } else { "end" });
        let origin = "end (Pole)";
        if matches!(piece.coordinate, Coordinate::FromTip(_) | Coordinate::ToTip(_)) {
            let text = format!("d ln(mu/lambda)/d eta = 0 at {end}, the state that reaches the tip");
            self.add(format!("{end}: u = 0 (tip)"), text, origin, &|b, x| Ok(x.end(b, i, side, Field::TipDrift)));
            return;
        }
        let text = format!("{end}.lambda = {end}.mu, the regular state of u = 0");
        self.add(format!("{end}: u = 0"), text, origin, &|b, x| {
            let (l, r) = (x.end(b, i, side, Field::Lambda), x.end(b, i, side, Field::Mu));
            Ok(b.sub(l, r))
        });
        if matches!(piece.kind, Kind::Free) {
            let (value, word) = if side == Side::Start { (0.0, "0") } else { (PI, "pi") };
            let said = [format!("{end}: tau = {word}"), format!("{end}.tau = {word}"), origin.to_owned()];
            self.fixed(i, side, Field::Tau, value, said);
        }
    }

    /// A mirror plane behind the last piece.
    pub(super) fn mirror(&mut self, i: usize, h: &Number, height: Option<f64>) {
        let end = format!("{}.end", self.system.pieces[i].name);
        let origin = "end (Mirror)";
        let said = [format!("{end}: tau = pi/2"), format!("{end}.tau = pi/2"), origin.to_owned()];
        self.fixed(i, Side::End, Field::Tau, PI / 2.0, said);
        self.held(i, h, height, origin);
    }

    /// The end of the last piece is held at an axial position.
    fn held(&mut self, i: usize, h: &Number, height: Option<f64>, origin: &str) {
        let end = format!("{}.end", self.system.pieces[i].name);
        let value = height.unwrap_or(0.0);
        self.add(format!("{end}: h"), format!("{end}.h = {}", bracket(h)), origin, &|b, x| {
            let h = x.h(b, i, Side::End)?;
            let v = b.constant(value);
            Ok(b.sub(h, v))
        });
    }

    /// A clamp that holds the rim behind the last piece.
    pub(super) fn clamp(&mut self, i: usize, [u, h]: [&Number; 2], height: Option<f64>, at: &str) {
        let end = format!("{}.end", self.system.pieces[i].name);
        let origin = "end (Clamped)";
        if let Some(value) = self.names.constant(u, &format!("{at}/u"), self.errors) {
            let said = [format!("{end}: u"), format!("{end}.u = {}", bracket(u)), origin.to_owned()];
            self.fixed(i, Side::End, Field::U, value, said);
        }
        self.held(i, h, height, origin);
    }

    /// A smooth contact edge behind a piece.
    pub(super) fn smooth(&mut self, before: usize) {
        let origin = "joint (Smooth)";
        for (what, field) in [("u", Field::Mu), ("tau", Field::Tau), ("lambda", Field::Lambda)] {
            self.continuous(before, what, field, origin);
        }
        self.level(before, origin);
    }

    /// A field has one value on both sides of the joint behind a piece.
    fn continuous(&mut self, before: usize, what: &str, field: Field, origin: &str) {
        let [a, b] = [before, before + 1].map(|i| self.system.pieces[i].name.clone());
        let (name, text) = (format!("{a}/{b}: {what} continuous"), format!("{a}.end.{what} = {b}.start.{what}"));
        self.add(name, text, origin, &|b, x| {
            let (l, r) = (x.end(b, before, Side::End, field), x.end(b, before + 1, Side::Start, field));
            Ok(b.sub(l, r))
        });
    }

    /// h has one value on both sides of the joint behind a piece.
    fn level(&mut self, before: usize, origin: &str) {
        let [a, b] = [before, before + 1].map(|i| self.system.pieces[i].name.clone());
        let (name, text) = (format!("{a}/{b}: h continuous"), format!("{a}.end.h = {b}.start.h"));
        self.add(name, text, origin, &|b, x| {
            let (l, r) = (x.h(b, before, Side::End)?, x.h(b, before + 1, Side::Start)?);
            Ok(b.sub(l, r))
        });
    }

    /// The edge of an adhering contact behind a piece, in the limit of zero range: the tangent jumps, the pull of the free side along
    /// the face is that of the contact (Young, Dupre), and what the membrane gains by sliding out of the contact is the energy.
    pub(super) fn adhesive(&mut self, before: usize, free_first: bool, energy: &Number, at: &str) -> Option<Adhesion> {
        let origin = "joint (AdhesiveEdge)";
        let at = format!("{at}/AdhesiveEdge/energy");
        let known = self.names.number(self.system, energy, &at, self.errors)?;
        self.continuous(before, "u", Field::Mu, origin);
        self.level(before, origin);
        let [a, b] = [before, before + 1].map(|i| self.system.pieces[i].name.clone());
        let (free, held) = if free_first {
            (format!("{a}.end"), format!("{b}.start"))
        } else {
            (format!("{b}.start"), format!("{a}.end"))
        };
        let text = format!("{free}.w_l*cos({free}.tau - {held}.tau) = {held}.w_l");
        self.read(format!("{a}/{b}: pull along the face"), &text, origin, &at);
        let side = |s: &str| format!("{s}.lambda*{s}.w_l - {s}.w");
        let text = format!("{} = {} + {}", side(&free), side(&held), bracket(energy));
        self.read(format!("{a}/{b}: energy of adhesion"), &text, origin, &at);
        Some(Adhesion { before, free_first, energy: known })
    }

    /// The line between two faces of one body that meet smoothly, behind a piece.
    pub(super) fn seam(&mut self, before: usize, rigid: Option<&Rigid>, faces: [usize; 2], at: &str) {
        let origin = "joint (Smooth)";
        let met = rigid.and_then(|rigid| {
            let [a, b] = faces.map(|f| &rigid.faces[f]);
            // The outer face goes on where the inner one ends; the walk may go either way.
            match faces {
                [i, j] if j == i + 1 => Some([a.range[1], b.range[0]]),
                [i, j] if i == j + 1 => Some([a.range[0], b.range[1]]),
                _ => None,
            }
        });
        let Some(met) = met else {
            self.errors.push(
                Diagnostic::error("no-seam", "these two contacts do not lie on neighbouring faces of one body")
                    .at(at.to_owned(), "joined smoothly")
                    .help("a free segment or a kink lies between contacts on different bodies"),
            );
            return;
        };
        self.continuous(before, "lambda", Field::Lambda, origin);
        for (piece, side, end, t) in [(before, Side::End, "end", met[0]), (before + 1, Side::Start, "start", met[1])] {
            let name = self.system.pieces[piece].name.clone();
            let said = [format!("{name}: {end} of the face"), format!("{name} ends with its face"), origin.to_owned()];
            self.fixed(piece, side, Field::Along, t, said);
        }
    }

    /// A sharp rigid edge behind a piece: both sides at its u and h as far as their faces do not satisfy that already, then its law.
    pub(super) fn kink(&mut self, before: usize, bend: &Bend, law: &KinkLaw, at: &str) {
        let Bend { name, body, edge, .. } = *bend;
        let [radius, depth] = edge.at;
        let down = self.names.faces_down(body);
        for (piece, side, end, which, on) in [
            (before, Side::End, "end", "before", bend.sides[0]),
            (before + 1, Side::Start, "start", "after", bend.sides[1]),
        ] {
            let end = format!("{}.{end}", self.system.pieces[piece].name);
            let origin = "joint (Kink)";
            // On a face that meets in the edge, its parameter there says both.
            let own = on.filter(|on| on.0 == body).and_then(|on| edge.on.iter().find(|(face, _)| *face == on.1));
            if let Some((_, t)) = own {
                let tube = matches!(&self.system.pieces[piece].kind, Kind::Contact(f) if !f.surface.axial());
                let (what, text) =
                    if tube { ("h", format!("{end}.h = {name}.h")) } else { ("u", format!("{end}.u = {radius}")) };
                self.fixed(piece, side, Field::Along, *t, [format!("{name}: {what} {which}"), text, origin.to_owned()]);
                continue;
            }
            let said = [format!("{name}: u {which}"), format!("{end}.u = {radius}"), origin.to_owned()];
            self.fixed(piece, side, Field::U, radius, said);
            self.add(format!("{name}: h {which}"), format!("{end}.h = {name}.h"), origin, &|b, x| {
                let (h, at) = (x.h(b, piece, side)?, x.body_h(b, body)?);
                let behind = b.constant(if down { -depth } else { depth });
                let at = b.sum(at, behind);
                Ok(b.sub(h, at))
            });
        }
        match law {
            KinkLaw::Frictionless => {
                let side = |s: &str| format!("{name}.{s}.lambda*{name}.{s}.w_l - {name}.{s}.w");
                let text = format!("{} = {}", side("before"), side("after"));
                let what = format!("{name}: frictionless, lambda w_l - w continuous");
                self.read(what, &text, "joint (Kink, Frictionless)", at);
            }
            KinkLaw::Stuck => {
                let text = format!("{name}.phi = {:?}", bend.phi);
                self.read(format!("{name}: stuck where it first touched"), &text, "joint (Kink, Stuck)", at);
            }
            KinkLaw::StuckAt(place) => {
                // The place is an equation in the local phi or S at the edge.
                let text = local_to_edge(place.as_str(), name);
                let at = format!("{at}/Kink/law/StuckAt");
                self.read(format!("{name}: stuck"), &text, "joint (Kink, StuckAt)", &at);
            }
            KinkLaw::Conditions(list) => {
                for (what, text) in list {
                    let at = format!("{at}/Kink/law/Conditions/{}", token(what));
                    self.read(what.clone(), text.as_str(), "joint (Kink, Conditions)", &at);
                }
            }
            KinkLaw::Capstan { friction } => {
                let at = format!("{at}/Kink/law/Capstan/friction");
                let origin = "joint (Kink, Capstan)";
                match bend.grip {
                    Grip::First | Grip::At(_) => {
                        let phi = if let Grip::At(phi) = bend.grip { phi } else { bend.phi };
                        self.read(format!("{name}: sticks"), &format!("{name}.phi = {phi:?}"), origin, &at);
                    }
                    grip => self.read(format!("{name}: slides"), &pull(name, friction, grip), origin, &at),
                }
            }
        }
    }

    /// A joint with what is written and nothing else.
    pub(super) fn joint(
        &mut self,
        name: &str,
        continuous: &[Formula],
        conditions: &IndexMap<String, Equation>,
        at: &str,
    ) {
        let origin = "joint (Joint)";
        for (k, field) in continuous.iter().enumerate() {
            let field = field.as_str();
            let text = format!("{name}.before.{field} = {name}.after.{field}");
            self.read(format!("{name}: {field} continuous"), &text, origin, &format!("{at}/Joint/continuous/{k}"));
        }
        for (what, text) in conditions {
            self.read(what.clone(), text.as_str(), origin, &format!("{at}/Joint/conditions/{}", token(what)));
        }
    }
}

/// `phi = ..` or `S = ..` at an edge: the local name becomes that of the edge.
fn local_to_edge(text: &str, edge: &str) -> String {
    let trimmed = text.trim_start();
    for field in ["phi", "S"] {
        if let Some(rest) = trimmed.strip_prefix(field)
            && rest.trim_start().starts_with('=')
        {
            return format!("{edge}.{field}{rest}");
        }
    }
    text.to_owned()
}
