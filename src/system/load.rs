//! Given tractions: forces per area that depend on where the membrane is and how it is stretched.
//!
//! A load is a formula with one output for each component that it has. Its force per reference area (q_u, q_h), away from the axis
//! and downwards, enters the equations of the membrane as
//!
//! ```text
//! d(rho0 w_l)/d eta = .. - rho0^2 q_t,       q_t = q_u cos tau + q_h sin tau
//! w_l dtau/d eta    = .. + rho0 q_n,         q_n = q_u sin tau - q_h cos tau
//! ```

use crate::expr::Tape;
use crate::physics::membrane::Local;
use crate::scalar::Scalar;

/// What a load's formula may depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Variable {
    /// A global.
    Global(usize),
    /// Distance from the axis.
    U,
    /// Axial position, downwards.
    H,
    /// Tangent angle.
    Tau,
    /// Meridional stretch.
    Lambda,
    /// Hoop stretch.
    Mu,
    /// Material angle from the top pole.
    Phi,
    /// Reference arc length from the top pole.
    S,
    /// Reference radius.
    Rho0,
    /// Energy per reference area.
    W,
    /// Meridional tension per reference length.
    TensionL,
    /// Hoop tension per reference length.
    TensionM,
    /// Contact pressure; zero where nothing is touched.
    ContactPressure,
}

/// A component of a load.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Component {
    /// Along the outward normal.
    Normal,
    /// Along the meridian, in the direction of growing S.
    Tangential,
    /// Away from the axis.
    Radial,
    /// Along the axis, downwards.
    Axial,
}

/// A traction, and the areas it refers to.
#[derive(Clone, Debug)]
pub struct Load {
    /// Its name in the problem file.
    pub name: String,
    /// One output for each component.
    pub tape: Tape,
    /// The inputs of the tape.
    pub variables: Vec<Variable>,
    /// What the outputs are.
    pub components: Vec<Component>,
    /// True if it is a force per current area, false per reference area.
    pub current: bool,
}

/// Where a load acts.
#[derive(Clone, Copy, Debug)]
pub struct Site<S> {
    /// The membrane there.
    pub local: Local<S>,
    /// Tangent angle.
    pub tau: S,
    /// Axial position.
    pub h: S,
    /// Material angle.
    pub phi: S,
    /// Reference arc length.
    pub arc: S,
    /// Contact pressure, where a field asks for it.
    pub pressed: S,
}

impl<S: Scalar> Site<S> {
    /// The value of a variable that is no global.
    ///
    /// # Panics
    /// For globals, which have no place.
    pub fn value(&self, variable: Variable) -> S {
        let m = &self.local;
        match variable {
            Variable::Global(_) => unreachable!("a global has no place"),
            Variable::U => m.u(),
            Variable::H => self.h,
            Variable::Tau => self.tau,
            Variable::Lambda => m.lambda,
            Variable::Mu => m.mu,
            Variable::Phi => self.phi,
            Variable::S => self.arc,
            Variable::Rho0 => m.rho0,
            Variable::W => m.response.w,
            Variable::TensionL => m.response.w_l,
            Variable::TensionM => m.response.w_m,
            Variable::ContactPressure => self.pressed,
        }
    }
}

impl Load {
    /// The globals it depends on, in the order of its variables.
    pub fn globals(&self) -> impl Iterator<Item = usize> + '_ {
        self.variables.iter().filter_map(|v| if let Variable::Global(g) = v { Some(*g) } else { None })
    }

    /// The force per reference area, away from the axis and downwards; `globals` in the order of [`Load::globals`].
    pub fn force<S: Scalar>(&self, site: &Site<S>, globals: &[S]) -> [S; 2] {
        let m = &site.local;
        let mut next = globals.iter();
        let inputs: Vec<S> = self
            .variables
            .iter()
            .map(|v| match v {
                Variable::Global(_) => *next.next().expect("a value for each global"),
                v => site.value(*v),
            })
            .collect();
        let (mut work, mut out) = (vec![], vec![S::from(0.0); self.components.len()]);
        self.tape.eval(&inputs, &mut work, &mut out);
        let (mut radial, mut axial) = (S::from(0.0), S::from(0.0));
        for (component, v) in self.components.iter().zip(out) {
            match component {
                Component::Normal => (radial, axial) = (radial + v * m.sin, axial - v * m.cos),
                Component::Tangential => (radial, axial) = (radial + v * m.cos, axial + v * m.sin),
                Component::Radial => radial = radial + v,
                Component::Axial => axial = axial + v,
            }
        }
        let area = if self.current { m.lambda * m.mu } else { S::from(1.0) };
        [radial * area, axial * area]
    }
}

/// Tangential and normal parts of a force (away from the axis, downwards).
pub fn along<S: Scalar>(m: &Local<S>, [radial, axial]: [S; 2]) -> [S; 2] {
    [radial * m.cos + axial * m.sin, radial * m.sin - axial * m.cos]
}
