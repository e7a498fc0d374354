//! How much memory jobs may be thought to need.

use super::value::{ByteSize, SettingValue, Unit};

/// A number of bytes, or `auto` for 60 % of what the process may have: the limit of its control group, else the machine's memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryBudget(pub u64);

/// What is assumed where nothing says how much there is.
const FALLBACK_BYTES: u64 = 2 << 30;

impl SettingValue for MemoryBudget {
    const UNIT: Unit = Unit::Bytes;
    const EXAMPLE: &'static str = "2GiB";

    fn parse(text: &str) -> Result<Self, String> {
        if text == "auto" {
            return Ok(Self(available_bytes().map_or(FALLBACK_BYTES, |bytes| bytes / 5 * 3)));
        }
        ByteSize::parse(text).map(|size| Self(size.0)).map_err(|expected| format!("{expected}, or 'auto'"))
    }

    fn number(&self) -> Option<f64> {
        Some(self.0 as f64)
    }
}

impl MemoryBudget {
    /// What all engine processes may have in use together, where the system says how much there is: what is left is the service's own, so
    /// that it is not the kernel that chooses who goes, which in a container may be everybody.
    #[must_use]
    pub fn of_all_processes() -> Option<u64> {
        available_bytes().map(|bytes| bytes / 5 * 4)
    }
}

fn available_bytes() -> Option<u64> {
    let read = |path: &str| std::fs::read_to_string(path).ok();
    let groups = ["/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"];
    // Where there is no limit, the file says "max", or a number larger than any machine.
    let group = groups.iter().filter_map(|path| read(path)?.trim().parse::<u64>().ok()).min();
    let machine = read("/proc/meminfo").and_then(|text| machine_bytes(&text));
    group.into_iter().chain(machine).min()
}

fn machine_bytes(meminfo: &str) -> Option<u64> {
    let line = meminfo.lines().find_map(|line| line.strip_prefix("MemTotal:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes << 10)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_budget_is_a_size_or_found_out() {
        assert_eq!(MemoryBudget::parse("2GiB"), Ok(MemoryBudget(2 << 30)), "a size");
        assert!(MemoryBudget::parse("auto").is_ok_and(|budget| budget.0 > 1 << 20), "found out");
        assert!(MemoryBudget::parse("much").is_err_and(|expected| expected.contains("'auto'")), "says what it takes");
        assert_eq!(machine_bytes("MemTotal:       2048 kB\nMemFree: 1 kB\n"), Some(2 << 20), "as Linux writes it");
    }
}
