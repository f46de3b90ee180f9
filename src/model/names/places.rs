//! Dotted names: fields at the ends of segments, joints, bodies, tractions, sums over the membrane, the initial state.

use super::scope::{Binder, Bound};
use super::{JointName, Level, Names};
use crate::expr::{Builder, ExprError, Function, Node, nearest};
use crate::physics::surface::Facing;
use crate::spec::{Substrate, Traction};
use crate::system::{Coordinate, Field, Kind, LOADS_AT, Probe, Side};
use std::f64::consts::PI;
use std::ops::Range;

impl Binder<'_, '_> {
    /// Axial position of an end of a piece.
    pub fn h(&mut self, builder: &mut Builder, piece: usize, side: Side) -> Bound {
        let info = &self.names.pieces[piece];
        if let (Some(body), None) = (info.body, info.h0) {
            let apex = self.body_h(builder, body)?;
            let drop = match (self.names.shapes[piece].coordinate, side) {
                (Coordinate::FromTip(_), Side::Start) | (Coordinate::ToTip(_), Side::End) => builder.constant(0.0),
                _ => self.end(builder, piece, side, Field::Drop),
            };
            return Ok(builder.sum(apex, drop));
        }
        let Some(start) = info.h0 else { return Ok(self.end(builder, piece, side, Field::Height)) };
        let start = self.probe(builder, Probe::Global(start));
        Ok(match side {
            Side::Start => start,
            Side::End => {
                let fall = self.probe(builder, Probe::Quadrature(piece, 0));
                builder.sum(start, fall)
            }
        })
    }

    /// Axial force of the membrane on the body under a piece, positive when it presses.
    ///
    /// Balance of the patch: p pi [u^2] - 2 pi [rho0 w_l sin tau]; both vanish at a pole or tip.
    fn force(&mut self, builder: &mut Builder, piece: usize) -> Bound {
        let shape = self.names.shapes[piece].clone();
        let p = match shape.pressure.fluid {
            Some(g) => self.probe(builder, Probe::Global(g)),
            None => builder.constant(0.0),
        };
        let mut total = builder.constant(0.0);
        for (side, sign) in [(Side::Start, -1.0), (Side::End, 1.0)] {
            use Coordinate::{FromPole, FromTip, PoleToPole, ToPole, ToTip};
            let closed = matches!(
                (side, shape.coordinate),
                (Side::Start, FromPole(_) | FromTip(_) | PoleToPole) | (Side::End, ToPole(_) | ToTip(_) | PoleToPole)
            );
            if closed {
                continue;
            }
            let (u, rho0) = (self.end(builder, piece, side, Field::U), self.end(builder, piece, side, Field::Rho0));
            let (w_l, tau) =
                (self.end(builder, piece, side, Field::TensionL), self.end(builder, piece, side, Field::Tau));
            let square = builder.mul(u, u);
            let pi = builder.constant(PI);
            let disc = builder.mul(square, pi);
            let disc = builder.mul(disc, p);
            let sin = builder.apply(Function::Sin, tau);
            let pull = builder.mul(rho0, w_l);
            let pull = builder.mul(pull, sin);
            let two_pi = builder.constant(2.0 * PI);
            let pull = builder.mul(pull, two_pi);
            let part = builder.sub(disc, pull);
            let sign = builder.constant(sign);
            let part = builder.mul(part, sign);
            total = builder.sum(total, part);
        }
        // Other tractions press the membrane on the body as well.
        let own = shape.repulsion.as_ref().map(|_| shape.repulsion_at());
        for q in (LOADS_AT..LOADS_AT + shape.loads.len()).chain(own) {
            let other = self.probe(builder, Probe::Reported(piece, q));
            total = builder.sub(total, other);
        }
        let down = match &shape.kind {
            Kind::Contact(face) => face.facing == Facing::Down,
            _ => true,
        };
        Ok(if down { total } else { builder.neg(total) })
    }

    fn sum_of(&mut self, builder: &mut Builder, pieces: &[usize], mut f: impl FnMut(&Names, usize) -> Probe) -> Node {
        let mut total = builder.constant(0.0);
        for &s in pieces {
            let probe = f(self.names, s);
            let node = self.probe(builder, probe);
            total = builder.sum(total, node);
        }
        total
    }

    pub(super) fn scaled(&self, builder: &mut Builder, node: Node) -> Node {
        let images = builder.constant(self.names.images);
        builder.mul(node, images)
    }

    /// Sums over pieces: `energy`, `area`, `length`, `reference_area`, `volume`.
    fn over(&mut self, builder: &mut Builder, pieces: &[usize], what: &str) -> Option<Node> {
        let kind = |names: &Names, s: usize| names.shapes[s].kind.coupled() > 0;
        Some(match what {
            "energy" => self.sum_of(builder, pieces, |_, s| Probe::Reported(s, 0)),
            "area" => self.sum_of(builder, pieces, |_, s| Probe::Reported(s, 1)),
            "length" => {
                self.sum_of(
                    builder,
                    pieces,
                    |names, s| {
                        if kind(names, s) { Probe::Reported(s, 2) } else { Probe::FaceLength(s) }
                    },
                )
            }
            "reference_area" => self.sum_of(builder, pieces, |_, s| Probe::Reported(s, 3)),
            "volume" => self.sum_of(builder, pieces, |names, s| {
                if kind(names, s) { Probe::Quadrature(s, 1) } else { Probe::SweptVolume(s) }
            }),
            _ => return None,
        })
    }

    fn initial(&mut self, builder: &mut Builder, rest: &str, span: Range<usize>) -> Bound {
        let Some(i) = self.names.initial.as_ref() else {
            return Err(ExprError::new("no-initial", span, "the initial state is not known yet here").into());
        };
        let value = match rest {
            "p_f" => i.pressure + i.outside,
            "overpressure" => i.pressure,
            "lambda" | "mu" => i.stretch,
            "w_l" | "w_m" => i.tension,
            "membrane.volume" => i.volume,
            "membrane.energy" => i.energy,
            "membrane.height" => 2.0 * i.radius,
            "membrane.area" => i.reference.area() * i.stretch * i.stretch,
            "membrane.reference_area" => i.reference.area(),
            name => match self.names.initial_values.get(name).copied().or_else(|| self.initial_place(name)) {
                Some(v) => v,
                None => {
                    let help = "p_f, overpressure, lambda, mu, w_l, w_m, membrane.volume, membrane.energy, membrane.height, membrane.area, \
                                membrane.reference_area, an unknown, or a place such as membrane.start.h or side.end.phi";
                    return Err(ExprError::new("unknown-name", span, format!("`initial.{name}` is not known"))
                        .help(format!("after `initial.`: {help}"))
                        .into());
                }
            },
        };
        Ok(builder.constant(value))
    }

    /// The pieces of the contact to which a piece belongs: itself, or all of the faces that meet smoothly where it is the first.
    pub(super) fn group(&self, s: usize) -> Vec<usize> {
        let piece = &self.names.pieces[s];
        if piece.chain == 1 || piece.part > 0 {
            return vec![s];
        }
        (0..self.names.pieces.len()).filter(|&i| self.names.pieces[i].element == piece.element).collect()
    }

    /// A field at an end of a segment, or at a joint, of the initial sphere.
    fn initial_place(&self, name: &str) -> Option<f64> {
        let (i, standing) = (self.names.initial.as_ref()?, self.names.standing.as_ref()?);
        let (place, field) = name.rsplit_once('.')?;
        let last = self.names.pieces.len().checked_sub(1)?;
        let end = i.last_phi();
        let at = |joint: Option<usize>| joint.map_or(0.0, |j| standing.joints.get(j).copied().unwrap_or(end));
        let phi = match place {
            "membrane.start" => 0.0,
            "membrane.end" => at(Some(last)),
            _ => {
                let segment = place.rsplit_once('.').and_then(|(segment, side)| {
                    let s = self.names.pieces.iter().position(|p| p.name == segment)?;
                    match side {
                        "start" => Some(at(s.checked_sub(1))),
                        "end" => Some(at(Some(s))),
                        _ => None,
                    }
                });
                let joint = || self.names.joints.iter().find(|j| j.name == place).map(|j| at(Some(j.before)));
                segment.or_else(joint)?
            }
        };
        Some(match field {
            "phi" => phi,
            "tau" => i.tau(phi),
            "S" => phi * i.reference.radius(),
            "rho0" => i.reference.radius() * i.profile(phi)[0],
            "u" => i.radius * i.profile(phi)[0],
            "h" => standing.middle - i.radius * i.profile(phi)[1],
            "lambda" | "mu" => i.stretch,
            "w_l" | "w_m" => i.tension,
            _ => return None,
        })
    }

    pub(super) fn dotted(&mut self, builder: &mut Builder, name: &str, span: Range<usize>) -> Bound {
        let unknown = |message: String, help: String| -> Vec<ExprError> {
            ExprError::new("unknown-name", span.clone(), message).help(help).into()
        };
        let (first, rest) = name.split_once('.').expect("a dotted name");
        if first == "initial" {
            return self.initial(builder, rest, span);
        }
        if first == "reference" {
            let Some(i) = self.names.initial.as_ref() else {
                return Err(ExprError::new("no-initial", span, "the reference shape is not known yet here").into());
            };
            return match rest {
                "volume" => Ok(builder.constant(i.reference.volume())),
                "area" => Ok(builder.constant(i.reference.area())),
                _ => Err(unknown(format!("`{name}` is not known"), "reference.volume, reference.area".into())),
            };
        }
        if self.level != Level::Full {
            let message = format!("`{name}` is known only once a state is solved, and a constant is needed here");
            return Err(ExprError::new("not-constant", span, message).into());
        }
        let all: Vec<usize> = (0..self.names.pieces.len()).collect();
        if let Some(traction) = self.names.problem.tractions.get(first) {
            return self.traction(builder, first, traction, rest, span);
        }
        if first == "membrane" {
            if rest != "reference_area"
                && let Some(node) = self.over(builder, &all, rest)
            {
                return Ok(self.scaled(builder, node));
            }
            let last = all.len() - 1;
            return match rest {
                "reference_area" => {
                    let area = self.names.initial.as_ref().map_or(0.0, |i| i.reference.area());
                    Ok(builder.constant(area))
                }
                "start.h" => self.h(builder, 0, Side::Start),
                "end.h" => self.h(builder, last, Side::End),
                "height" => {
                    let (top, bottom) = (self.h(builder, 0, Side::Start)?, self.h(builder, last, Side::End)?);
                    let half = builder.sub(bottom, top);
                    Ok(self.scaled(builder, half))
                }
                _ => Err(unknown(
                    format!("`{name}` is not known"),
                    "after `membrane.`: volume, energy, area, length, reference_area, height, start.h, end.h, max(u)"
                        .into(),
                )),
            };
        }
        let after = |prefix: &str| name.strip_prefix(prefix).and_then(|rest| rest.strip_prefix('.')).map(str::to_owned);
        // A joint: limits from both sides, its place, its force.
        let joint = self.names.joints.iter().find_map(|j| after(&j.name).map(|rest| (j.clone(), rest)));
        if let Some((joint, rest)) = joint {
            return self.joint(builder, &joint, &rest, span);
        }
        if let Some(rest) = self.names.absent.iter().find_map(|a| after(a)) {
            // Sums over what is absent are zero; a limit there does not exist.
            return Ok(match rest.as_str() {
                "energy" | "area" | "length" | "reference_area" | "volume" | "force" => builder.constant(0.0),
                _ => self.probe(builder, Probe::Absent),
            });
        }
        // The longest piece name that is a prefix, then a side and a field; or something of the whole piece or body.
        let piece = (0..self.names.pieces.len())
            .filter(|&s| {
                let p = &self.names.pieces[s].name;
                name.starts_with(p.as_str()) && name[p.len()..].starts_with('.')
            })
            .max_by_key(|&s| self.names.pieces[s].name.len());
        if let Some(s) = piece {
            let rest = &name[self.names.pieces[s].name.len() + 1..];
            if let Some((side, field)) = rest.split_once('.') {
                let side = match side {
                    "start" => Side::Start,
                    "end" => Side::End,
                    _ => {
                        return Err(unknown(
                            format!("`{side}` is not an end of `{}`", self.names.pieces[s].name),
                            "ends: start, end".into(),
                        ));
                    }
                };
                // A contact along several faces ends where the last of them does.
                let group = self.group(s);
                let s = if side == Side::Start { group[0] } else { group[group.len() - 1] };
                return self.limit(builder, s, side, field, span);
            }
            if let Some(node) = self.over(builder, &self.group(s), rest) {
                return Ok(node);
            }
        }
        self.of_body(builder, name, first, rest, span)
    }

    /// The whole axial force of a traction, downwards, or the energy of an electrostatic one.
    fn traction(
        &mut self,
        builder: &mut Builder,
        name: &str,
        traction: &Traction,
        rest: &str,
        span: Range<usize>,
    ) -> Bound {
        let all: Vec<usize> = (0..self.names.pieces.len()).collect();
        let repels = matches!(traction, Traction::SelfRepulsion { .. });
        let place = |names: &Names, s: usize| {
            let piece = &names.shapes[s];
            if repels {
                return piece.repulsion.as_ref().map(|_| piece.repulsion_at());
            }
            piece.loads.iter().position(|load| load.name == name).map(|i| LOADS_AT + i)
        };
        let sum = |binder: &mut Self, builder: &mut Builder, further: usize| {
            let on: Vec<usize> = all.iter().copied().filter(|&s| place(binder.names, s).is_some()).collect();
            let sum = binder
                .sum_of(builder, &on, |names, s| Probe::Reported(s, place(names, s).expect("it acts there") + further));
            binder.scaled(builder, sum)
        };
        // The image of the membrane in a plane is the plane's.
        let mine = matches!(traction, Traction::ChargedPlane { substrate, .. } if *substrate != Substrate::Transparent);
        let image = |names: &Names, s: usize| {
            let repulsion = names.shapes[s].repulsion.as_ref().filter(|r| r.image.is_some() && (mine || repels))?;
            (repulsion.reported() > 2).then(|| names.shapes[s].repulsion_at() + 2)
        };
        let of_image = |binder: &mut Self, builder: &mut Builder, further: usize| {
            let on: Vec<usize> = all.iter().copied().filter(|&s| image(binder.names, s).is_some()).collect();
            let sum = binder
                .sum_of(builder, &on, |names, s| Probe::Reported(s, image(names, s).expect("it has one") + further));
            binder.scaled(builder, sum)
        };
        match (rest, traction) {
            ("force", _) => {
                let force = sum(self, builder, 0);
                let image = of_image(self, builder, 0);
                Ok(if repels { builder.sub(force, image) } else { builder.sum(force, image) })
            }
            ("image_energy", Traction::ChargedPlane { .. }) if mine => Ok(of_image(self, builder, 1)),
            ("energy", Traction::SelfRepulsion { .. }) => Ok(sum(self, builder, 1)),
            ("energy", Traction::ChargedPlane { debye_length, .. }) => {
                // The force falls off as exp(-d/debye_length), so its potential is the force times that length.
                let force = sum(self, builder, 0);
                let length = self.names.constant(debye_length, "", &mut vec![]).unwrap_or(f64::NAN);
                let length = builder.constant(-length);
                let direct = builder.mul(force, length);
                let image = of_image(self, builder, 1);
                Ok(builder.sum(direct, image))
            }
            _ => {
                let more = match traction {
                    Traction::Applied { .. } => "",
                    _ if mine => ", energy, image_energy",
                    _ => ", energy",
                };
                Err(ExprError::new("unknown-name", span, format!("`{name}.{rest}` is not known"))
                    .help(format!("of this traction: force{more}"))
                    .into())
            }
        }
    }

    /// A field at an end of a piece, by its name.
    fn limit(&mut self, builder: &mut Builder, s: usize, side: Side, field: &str, span: Range<usize>) -> Bound {
        let unknown = |message: String, help: String| -> Vec<ExprError> {
            ExprError::new("unknown-name", span.clone(), message).help(help).into()
        };
        let field = match field {
            "lambda" => Field::Lambda,
            "mu" => Field::Mu,
            "tau" => Field::Tau,
            "u" => Field::U,
            "phi" => Field::Phi,
            "S" => Field::S,
            "rho0" => Field::Rho0,
            "w" => Field::W,
            "w_l" => Field::TensionL,
            "w_m" => Field::TensionM,
            "p_c" if self.names.pieces[s].body.is_some() => Field::ContactPressure,
            "h" => return self.h(builder, s, side),
            "tip_coefficient" if self.names.pieces[s].body.is_some() => {
                return Ok(self.probe(builder, Probe::TipCoefficient(s, side)));
            }
            _ => {
                let fields = ["phi", "S", "rho0", "u", "h", "lambda", "mu", "tau", "w", "w_l", "w_m"];
                let mut all = fields.join(", ");
                if self.names.pieces[s].body.is_some() {
                    all += ", p_c, tip_coefficient";
                }
                let near = nearest(field, fields).map(|n| format!("did you mean `{n}`? ")).unwrap_or_default();
                return Err(unknown(format!("`{field}` is not a field"), format!("{near}fields: {all}")));
            }
        };
        Ok(self.end(builder, s, side, field))
    }

    /// Something of a joint, by its name.
    fn joint(&mut self, builder: &mut Builder, joint: &JointName, rest: &str, span: Range<usize>) -> Bound {
        if let Some((which, field)) = rest.split_once('.') {
            match which {
                "before" => return self.limit(builder, joint.before, Side::End, field, span),
                "after" => return self.limit(builder, joint.after, Side::Start, field, span),
                _ => {}
            }
        }
        match (rest, joint.body) {
            ("phi" | "S" | "rho0" | "u", _) => self.limit(builder, joint.after, Side::Start, rest, span),
            ("h", Some(body)) => {
                let apex = self.body_h(builder, body)?;
                let behind = builder.constant(joint.behind);
                Ok(builder.sum(apex, behind))
            }
            ("h", None) => self.limit(builder, joint.after, Side::Start, "h", span),
            ("force", Some(body)) => {
                // Axial pull of the edge on the membrane, away from its body: each side with its own tension.
                let down = self.names.faces_down(body);
                let mut total = builder.constant(0.0);
                for (piece, side, sign) in [(joint.before, Side::End, 1.0), (joint.after, Side::Start, -1.0)] {
                    let parts = [Field::Rho0, Field::TensionL].map(|f| self.end(builder, piece, side, f));
                    let tau = self.end(builder, piece, side, Field::Tau);
                    let sin = builder.apply(Function::Sin, tau);
                    let factor = builder.constant(sign * 2.0 * PI);
                    let pull = builder.mul(parts[0], parts[1]);
                    let pull = builder.mul(pull, sin);
                    let pull = builder.mul(pull, factor);
                    total = builder.sum(total, pull);
                }
                Ok(if down { total } else { builder.neg(total) })
            }
            _ => Err(ExprError::new("unknown-name", span, format!("`{}.{rest}` is not known", joint.name))
                .help(format!(
                    "of a joint: {0}.phi, {0}.u, {0}.h, {0}.before.lambda, {0}.after.tau, .., {0}.force",
                    joint.name
                ))
                .into()),
        }
    }

    /// Something of a whole body.
    fn of_body(&mut self, builder: &mut Builder, name: &str, first: &str, rest: &str, span: Range<usize>) -> Bound {
        let unknown = |message: String, help: String| -> Vec<ExprError> {
            ExprError::new("unknown-name", span.clone(), message).help(help).into()
        };
        let all: Vec<usize> = (0..self.names.pieces.len()).collect();
        if let Some(body) = self.names.problem.bodies.get_index_of(first) {
            let on: Vec<usize> = all.iter().copied().filter(|&s| self.names.pieces[s].body == Some(body)).collect();
            return match rest {
                "h" => self.body_h(builder, body),
                "force" => {
                    let mut total = builder.constant(0.0);
                    for s in on {
                        let f = self.force(builder, s)?;
                        total = builder.sum(total, f);
                    }
                    for joint in self.names.joints.clone().iter().filter(|j| j.body == Some(body)) {
                        let f = self.joint(builder, joint, "force", span.clone())?;
                        total = builder.sum(total, f);
                    }
                    Ok(total)
                }
                "area" => Ok(self.over(builder, &on, "area").expect("areas can be summed")),
                _ => Err(unknown(
                    format!("`{name}` is not known"),
                    format!(
                        "of a body: {first}.force, {first}.h, {first}.area; of a contact: {first}.start.u, {first}.end.phi, .."
                    ),
                )),
            };
        }
        let mut known: Vec<&str> = self.names.pieces.iter().map(|p| p.name.as_str()).collect();
        known.extend(self.names.joints.iter().map(|j| j.name.as_str()));
        known.extend(
            self.names.problem.bodies.keys().map(String::as_str).filter(|b| !known.contains(b)).collect::<Vec<_>>(),
        );
        known.extend(self.names.problem.tractions.keys().map(String::as_str));
        known.extend(["membrane", "initial", "reference"]);
        let near = nearest(first, known.iter().copied()).map(|n| format!("did you mean `{n}`? ")).unwrap_or_default();
        Err(ExprError::new(
            "unknown-name",
            span.start..span.start + first.len(),
            format!("there is no segment or body `{first}`"),
        )
        .help(format!("{near}segments and bodies: {}", known.join(", ")))
        .into())
    }
}
