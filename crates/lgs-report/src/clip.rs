//! Clipping of paths to a box.

/// Pieces of a path inside of a box (Liang–Barsky); what is not finite is left out.
pub(crate) fn clipped(points: &[(f64, f64)], low: [f64; 2], high: [f64; 2]) -> Vec<Vec<(f64, f64)>> {
    let mut pieces: Vec<Vec<(f64, f64)>> = Vec::new();
    let mut open = false;
    for pair in points.windows(2) {
        let Some((from, to)) = inside([pair[0].0, pair[0].1], [pair[1].0, pair[1].1], low, high) else {
            open = false;
            continue;
        };
        match pieces.last_mut().filter(|piece| open && piece.last() == Some(&from)) {
            Some(piece) => piece.push(to),
            None => pieces.push(vec![from, to]),
        }
        open = true;
    }
    pieces
}

/// The part of a segment inside of a box.
fn inside(a: [f64; 2], b: [f64; 2], low: [f64; 2], high: [f64; 2]) -> Option<((f64, f64), (f64, f64))> {
    if !a.iter().chain(&b).all(|v| v.is_finite()) {
        return None;
    }
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    for c in 0..2 {
        let d = b[c] - a[c];
        for (distance, towards) in [(low[c] - a[c], d), (a[c] - high[c], -d)] {
            if towards > 0.0 {
                enter = enter.max(distance / towards);
            } else if towards < 0.0 {
                leave = leave.min(distance / towards);
            } else if distance > 0.0 {
                return None;
            }
        }
    }
    let at = |s: f64| {
        if s == 0.0 {
            (a[0], a[1])
        } else if s == 1.0 {
            (b[0], b[1])
        } else {
            (a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]))
        }
    };
    (enter <= leave).then(|| (at(enter), at(leave)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_that_leaves_and_returns_is_two_pieces() {
        let points = [
            (0.0, 0.0),
            (0.5, 0.5),
            (2.0, 0.5),
            (2.0, 2.0),
            (0.5, 0.9),
            (f64::NAN, 0.0),
            (0.1, 0.1),
            (0.2, 0.2),
        ];
        let pieces = clipped(&points, [0.0; 2], [1.0; 2]);
        assert_eq!(pieces.len(), 3, "{pieces:?}");
        assert_eq!(pieces[0], [(0.0, 0.0), (0.5, 0.5), (1.0, 0.5)]);
        assert_eq!(pieces[2], [(0.1, 0.1), (0.2, 0.2)]);
        assert!(pieces[1].iter().all(|p| p.0 <= 1.0 && p.1 <= 1.0));
        assert!(clipped(&[(0.5, 0.5)], [0.0; 2], [1.0; 2]).is_empty());
    }
}
