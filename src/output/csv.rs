//! Tables for programs: comma-separated values, one header line, numbers that read back to the same bits.

use super::{Report, reason};
use crate::solution;
use std::fmt::Write;

/// A cell, in quotes where it must be.
fn cell(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.into() }
}

/// A number; nothing where there is none.
fn number(value: Option<f64>) -> String {
    value.filter(|v| v.is_finite()).map(|v| format!("{v:?}")).unwrap_or_default()
}

/// One line for each state: `point, reason, stage`, every quantity by name, and `err_NAME`, the estimated absolute error
/// of each that is not given.
pub fn branch(report: &Report) -> String {
    let model = report.model;
    let mut header: Vec<String> = ["point", "reason", "stage"].map(String::from).into();
    header.extend(model.parameters.iter().map(|p| cell(&p.0)));
    header.extend(model.quantities.iter().map(|q| cell(&q.name)));
    header.extend(model.quantities.iter().map(|q| cell(&format!("err_{}", q.name))));
    let mut text = header.join(",") + "\n";
    for (i, point) in report.outcome.points.iter().enumerate() {
        let quantities = &point.solution.quantities;
        let mut line = vec![i.to_string(), reason(point.reason).into(), cell(&point.model.stage())];
        line.extend(model.parameters.iter().map(|p| number(Some(p.1))));
        line.extend(quantities.iter().map(|q| number(q.map(|q| q.value))));
        line.extend(quantities.iter().map(|q| number(q.map(|q| q.error))));
        text += &line.join(",");
        text.push('\n');
    }
    text
}

/// One line for each mesh point of each state: `point, segment, phi, S, u, h, tau, lambda, mu, w_l, w_m, p_c`.
pub fn profiles(report: &Report) -> String {
    let mut text = String::from("point,segment,phi,S,u,h,tau,lambda,mu,w_l,w_m,p_c\n");
    for (i, point) in report.outcome.points.iter().enumerate() {
        for row in solution::profile(&point.model, &point.solution) {
            let numbers = [row.phi, row.arc, row.u, row.h, row.tau, row.lambda, row.mu, row.w_l, row.w_m];
            let _ = write!(text, "{i},{}", cell(&row.segment));
            for value in numbers.map(Some).into_iter().chain([row.p_c]) {
                text.push(',');
                text += &number(value);
            }
            text.push('\n');
        }
    }
    text
}
