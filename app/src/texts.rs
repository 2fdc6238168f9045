//! Phrases and numbers as the window and the command line print them.

use plait_core::weave::Improvement;

/// The result of a search for better strips.
pub fn improvement(i: &Improvement) -> String {
    if i.changes == 0 {
        return "no strips with a lower objective were found".into();
    }
    let state =
        |f: &plait_core::weave::Fit| format!("{:.1}° with {}", f.alignment, count(f.patches, "patch", "patches"));
    format!(
        "alignment error {} (before: {}), objective {:.1} (before: {:.1})",
        state(&i.after),
        state(&i.before),
        i.after.objective,
        i.before.objective,
    )
}

/// A number with its noun: "1 patch", "2 patches".
pub fn count(n: usize, one: &str, many: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { many })
}

/// A whole number with its digits in groups of three.
pub fn grouped(n: usize) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

/// A number with this many significant digits, all digits before the point, and at most six after it.
pub fn significant(value: f64, digits: u32) -> String {
    let decimals = (f64::from(digits) - 1.0 - value.abs().max(1e-9).log10().floor()).clamp(0.0, 6.0) as usize;
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_grouped() {
        assert_eq!([0, 999, 1000, 1234567].map(grouped), ["0", "999", "1 000", "1 234 567"]);
    }

    #[test]
    fn significant_digits_are_kept() {
        let texts = [0.0, 0.012345, 1.2345, 12345.6].map(|x| significant(x, 3));
        assert_eq!(texts, ["0.000000", "0.0123", "1.23", "12346"]);
    }

    #[test]
    fn one_thing_is_singular() {
        assert_eq!([0, 1, 2].map(|n| count(n, "patch", "patches")), ["0 patches", "1 patch", "2 patches"]);
    }

    #[test]
    fn an_improvement_names_both_states() {
        let fit = |patches, alignment| plait_core::weave::Fit { patches, alignment, ..Default::default() };
        let text = improvement(&Improvement { before: fit(20, 9.0), after: fit(1, 4.5), changes: 3 });
        assert!(text.contains("4.5° with 1 patch (before: 9.0° with 20 patches)"), "{text}");
    }

    #[test]
    fn a_search_without_success_claims_no_improvement() {
        let text = improvement(&Improvement::default());
        assert!(text.contains("no strips") && !text.contains("before"), "{text}");
    }
}
