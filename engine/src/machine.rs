//! What this machine has.

/// The bytes of memory that this process may use: those of the machine, or of the group that it runs in; `None`
/// if the system does not tell.
pub(crate) fn memory() -> Option<u64> {
    let read = |path: &str| std::fs::read_to_string(path).ok();
    let all = read("/proc/meminfo").and_then(|text| {
        let line = text.lines().find_map(|line| line.strip_prefix("MemTotal:"))?;
        Some(line.trim().trim_end_matches("kB").trim().parse::<u64>().ok()?.saturating_mul(1024))
    });
    let of_group = ["/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"];
    let limits = of_group.into_iter().filter_map(|path| read(path)?.trim().parse::<u64>().ok());
    limits.chain(all).filter(|bytes| *bytes > 0).min()
}

#[cfg(test)]
mod tests {
    #[test]
    fn memory_is_what_a_machine_has() {
        if let Some(bytes) = super::memory() {
            assert!((1 << 24..1 << 50).contains(&bytes), "{bytes}");
        }
    }
}
