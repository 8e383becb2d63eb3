//! Sets of time as sorted, disjoint, half-open intervals `[start, end)` in microseconds.

/// Half-open interval `[start, end)`, µs.
pub(super) type Interval = (u64, u64);

/// Appends an interval that starts no earlier than the last one, and merges the two if they touch.
/// Empty intervals are dropped.
pub(super) fn append(set: &mut Vec<Interval>, (start, end): Interval) {
    match set.last_mut() {
        _ if start >= end => {}
        Some(last) if start <= last.1 => last.1 = last.1.max(end),
        _ => set.push((start, end)),
    }
}

/// Returns all time in `a` or `b`.
pub(super) fn union(a: &[Interval], b: &[Interval]) -> Vec<Interval> {
    let mut out = Vec::with_capacity(a.len() + b.len());
    let (mut a, mut b) = (a.iter().peekable(), b.iter().peekable());
    loop {
        let next = match (a.peek(), b.peek()) {
            (Some(x), Some(y)) if x.0 <= y.0 => a.next(),
            (_, Some(_)) => b.next(),
            _ => a.next(),
        };
        match next {
            Some(&interval) => append(&mut out, interval),
            None => return out,
        }
    }
}

/// Returns all time in `a` but not in `b`.
pub(super) fn difference(a: &[Interval], b: &[Interval]) -> Vec<Interval> {
    let mut out = Vec::with_capacity(a.len());
    let mut first = 0;
    for &(mut start, end) in a {
        while b.get(first).is_some_and(|cut| cut.1 <= start) {
            first += 1;
        }
        for cut in b[first..].iter().take_while(|cut| cut.0 < end) {
            append(&mut out, (start, cut.0));
            start = start.max(cut.1);
        }
        append(&mut out, (start, end));
    }
    out
}

/// Returns whether `t_us` lies in the set.
pub(super) fn contains(set: &[Interval], t_us: u64) -> bool {
    let after = set.partition_point(|interval| interval.0 <= t_us);
    after > 0 && t_us < set[after - 1].1
}

/// Returns the part of the set before `end`.
pub(super) fn before(set: &[Interval], end: u64) -> Vec<Interval> {
    set.iter()
        .map_while(|&(a, b)| (a < end).then(|| (a, b.min(end))))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn set() -> impl Strategy<Value = Vec<Interval>> {
        prop::collection::vec((1u64..5, 1u64..5), 0..8).prop_map(|steps| {
            let mut t = 0;
            let mut out = Vec::new();
            for (gap, length) in steps {
                out.push((t + gap, t + gap + length));
                t += gap + length;
            }
            out
        })
    }

    proptest! {
        #[test]
        fn algebra_holds_at_every_microsecond(a in set(), b in set(), end in 0u64..40) {
            for t in 0..90 {
                let (in_a, in_b) = (contains(&a, t), contains(&b, t));
                prop_assert_eq!(contains(&union(&a, &b), t), in_a || in_b);
                prop_assert_eq!(contains(&difference(&a, &b), t), in_a && !in_b);
                prop_assert_eq!(contains(&before(&a, end), t), in_a && t < end);
            }
        }
    }
}
