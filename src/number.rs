//! Numbers for people: as many digits as are known, and no more than can be read.

/// Significant digits of a value with an absolute error: those that the error leaves, from 1 to `most`.
fn digits(value: f64, error: f64, most: usize) -> usize {
    let known = (value.abs() / error).log10().floor();
    if known.is_nan() { most } else { known.clamp(1.0, most as f64) as usize }
}

/// A value with the digits that its absolute error leaves, at most so many; zero where it leaves none.
pub fn known(value: f64, error: f64, most: usize) -> String {
    if value.abs() <= error { "0".into() } else { format(value, digits(value, error, most)) }
}

/// A value with so many significant digits.
pub fn format(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".into();
    }
    if !value.is_finite() {
        return value.to_string();
    }
    let scientific = format!("{value:.*e}", digits.saturating_sub(1));
    let exponent: i32 = scientific.split_once('e').and_then(|(_, e)| e.parse().ok()).unwrap_or(0);
    let decimals = digits as i32 - 1 - exponent;
    if exponent < -4 || decimals < 0 || exponent > 6 { scientific } else { format!("{value:.*}", decimals as usize) }
}

/// The same without zeros at its end, for numbers that were given.
pub fn plain(value: f64) -> String {
    let text = format(value, 7);
    let (number, exponent) = text.split_at(text.find('e').unwrap_or(text.len()));
    let number = if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number };
    format!("{number}{exponent}")
}

/// An error or a mismatch: two digits.
pub fn small(value: f64) -> String {
    if value == 0.0 { "0".into() } else { format!("{value:.1e}") }
}

/// Pads numbers so that their decimal points stand below each other.
pub fn align(cells: &mut [String]) {
    let point = |cell: &str| cell.find(['.', 'e']).unwrap_or(cell.len());
    let before = cells.iter().map(|c| point(c)).max().unwrap_or(0);
    let after = cells.iter().map(|c| c.len() - point(c)).max().unwrap_or(0);
    for cell in cells {
        let (left, right) = (before - point(cell), after - (cell.len() - point(cell)));
        *cell = format!("{}{cell}{}", " ".repeat(left), " ".repeat(right));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_more_digits_than_the_error_leaves() {
        assert_eq!(digits(1.0, 1e-12, 7), 7);
        assert_eq!(digits(1.234567, 1e-3, 7), 3);
        assert_eq!(digits(1.234567, 10.0, 7), 1);
        assert_eq!(digits(0.0, 0.0, 7), 7);
        assert_eq!(digits(1.0, 0.0, 7), 7);
        assert_eq!(format(1.234567, 3), "1.23");
        assert_eq!(known(1.234567, 1e-3, 7), "1.23");
        assert_eq!(known(-6e-15, 1e-13, 7), "0");
        assert_eq!(known(0.5, f64::NAN, 7), "0.5000000");
    }

    #[test]
    fn numbers_of_any_size_are_short() {
        assert_eq!(format(1234.5678, 7), "1234.568");
        assert_eq!(format(1234.5678, 2), "1.2e3");
        assert_eq!(format(-0.000123456789, 7), "-0.0001234568");
        assert_eq!(format(1.5e-7, 3), "1.50e-7");
        assert_eq!(format(123456789.0, 7), "1.234568e8");
        assert_eq!(format(0.0, 7), "0");
        assert_eq!(format(9.9999999, 3), "10.0");
        assert_eq!(plain(0.5), "0.5");
        assert_eq!(plain(40.0), "40");
        assert_eq!(plain(1e-9), "1e-9");
        assert_eq!(plain(100.0), "100");
    }

    #[test]
    fn points_stand_below_each_other() {
        let mut cells: Vec<String> = ["1.25", "-10.5", "3", "1e-9"].map(String::from).into();
        align(&mut cells);
        assert_eq!(cells, ["  1.25", "-10.5 ", "  3   ", "  1e-9"]);
    }
}
