//! Figures as people read them, in few columns.

/// A count or a rate, in at most six characters: `0`, `4.2`, `152`, `12.3k`.
pub(crate) fn number(value: f64) -> String {
    match value {
        v if v <= 0.0 => "0".to_owned(),
        v if v < 9.95 => format!("{v:.1}"),
        v if v < 9_999.5 => format!("{v:.0}"),
        v if v < 999_950.0 => format!("{:.1}k", v / 1e3),
        v => format!("{:.1}M", v / 1e6),
    }
}

/// Bytes, in at most eight characters: `512 B`, `7.0 kB`.
pub(crate) fn bytes(value: f64) -> String {
    match value {
        v if v < 999.5 => format!("{v:.0} B"),
        v if v < 999_950.0 => format!("{:.1} kB", v / 1e3),
        v => format!("{:.1} MB", v / 1e6),
    }
}

/// A time, in at most six characters: `190ms`, `4.2s`, `12min`, `3h10m`.
pub(crate) fn time(ms: u64) -> String {
    let seconds = ms / 1_000;
    match seconds {
        0 => format!("{ms}ms"),
        1..10 => format!("{:.1}s", ms as f64 / 1e3),
        10..120 => format!("{seconds}s"),
        120..7_200 => format!("{}min", seconds / 60),
        7_200..172_800 => format!("{}h{:02}m", seconds / 3_600, seconds / 60 % 60),
        _ => format!("{}d", seconds / 86_400),
    }
}

/// Per cent.
pub(crate) fn percent(value: f64) -> String {
    if value < 9.95 { format!("{value:.1}%") } else { format!("{value:.0}%") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_stay_short() {
        let shown: Vec<String> = [0.0, 0.25, 9.96, 152.4, 12_345.0, 2e6].map(number).into();
        assert_eq!(shown, ["0", "0.2", "10", "152", "12.3k", "2.0M"]);
        assert_eq!([0.0, 999.0, 7_040.0, 1.5e6].map(bytes), ["0 B", "999 B", "7.0 kB", "1.5 MB"]);
        let times = [0, 999, 4_250, 61_000, 720_000, 11_400_000, 999_999_000].map(time);
        assert_eq!(times, ["0ms", "999ms", "4.2s", "61s", "12min", "3h10m", "11d"]);
        assert_eq!([0.0, 2.44, 100.0].map(percent), ["0.0%", "2.4%", "100%"]);
    }
}
