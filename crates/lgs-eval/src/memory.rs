//! Peak memory of this process, where the operating system tells.

/// Largest resident set so far, in bytes: `VmHWM` of `/proc/self/status` on Linux, nothing elsewhere.
#[must_use]
pub fn peak_rss_bytes() -> Option<u64> {
    parse_peak(&std::fs::read_to_string("/proc/self/status").ok()?)
}

/// Starts the peak anew at what is resident now, where the operating system allows it (Linux); says whether
/// it did.
pub fn reset_peak_rss() -> bool {
    std::fs::write("/proc/self/clear_refs", "5").is_ok()
}

fn parse_peak(status: &str) -> Option<u64> {
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_peak_is_read_from_the_status_text() {
        assert_eq!(parse_peak("Name:\tx\nVmHWM:\t   5120 kB\nVmRSS:\t 1 kB\n"), Some(5120 * 1024));
        assert_eq!(parse_peak("Name:\tx\n"), None);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn linux_tells_the_peak() {
        assert!(peak_rss_bytes().is_some_and(|bytes| bytes > 1 << 20));
    }
}
