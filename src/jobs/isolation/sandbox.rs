//! What an engine process gives up before it reads anything: files, sockets, other programs, other processes.
//!
//! A decoder that somebody has taken over may then use up memory and time, and answer nonsense; it reaches neither the database nor the
//! network. Each lock is of the kernel's, and not every kernel has each: what is missing is told to the parent, which says so in its log.

#[cfg(target_os = "linux")]
use std::{collections::BTreeMap, io};

use serde::{Deserialize, Serialize};

/// Which locks are on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Sandbox {
    /// No program that it starts could gain privileges (`no_new_privs`).
    pub(super) gains_no_privileges: bool,
    /// The file system is out of reach (Landlock).
    pub(super) has_no_files: bool,
    /// Sockets, programs and other processes are out of reach (seccomp).
    pub(super) has_no_sockets: bool,
}

impl Sandbox {
    /// What is missing, in words; nothing where nothing is.
    pub(super) fn missing(self) -> Vec<&'static str> {
        let locks = [
            (self.gains_no_privileges, "no_new_privs"),
            (self.has_no_files, "Landlock"),
            (self.has_no_sockets, "seccomp"),
        ];
        locks.into_iter().filter(|(is_on, _)| !is_on).map(|(_, name)| name).collect()
    }
}

/// Locks this thread and all that it starts. To be called while there is no other thread, after everything was read that is in files.
#[cfg(target_os = "linux")]
pub(super) fn enter() -> Sandbox {
    let gains_no_privileges = rustix::thread::set_no_new_privs(true).is_ok();
    // Both ask for the first, so that nobody is shut in who could climb out.
    let (has_no_files, has_no_sockets) = match gains_no_privileges {
        true => (give_up_files().unwrap_or(false), give_up_calls().is_ok()),
        false => (false, false),
    };
    Sandbox { gains_no_privileges, has_no_files, has_no_sockets }
}

#[cfg(not(target_os = "linux"))]
pub(super) fn enter() -> Sandbox {
    Sandbox::default()
}

/// Takes away everything that this kernel's Landlock knows of. Pipes that are open stay.
#[cfg(target_os = "linux")]
fn give_up_files() -> Result<bool, landlock::RulesetError> {
    use landlock::{ABI, Access as _, AccessFs, AccessNet, Ruleset, RulesetAttr as _, RulesetStatus};
    let newest = ABI::V4;
    let rules =
        Ruleset::default().handle_access(AccessFs::from_all(newest))?.handle_access(AccessNet::from_all(newest))?;
    Ok(rules.create()?.restrict_self()?.ruleset != RulesetStatus::NotEnforced)
}

/// Calls of the system that fail from now on as if they were not allowed. Threads and memory stay.
#[cfg(target_os = "linux")]
fn give_up_calls() -> io::Result<()> {
    use seccompiler::{
        BpfProgram, SeccompAction, SeccompCmpArgLen, SeccompCmpOp, SeccompCondition, SeccompFilter, SeccompRule,
    };
    let other_than = |process: u64| {
        let condition = SeccompCondition::new(0, SeccompCmpArgLen::Dword, SeccompCmpOp::Ne, process)?;
        Ok(vec![SeccompRule::new(vec![condition])?])
    };
    let of_others =
        |call: i64, own: u64| Ok((call, other_than(own).map_err(io::Error::other::<seccompiler::BackendError>)?));
    let mut rules: BTreeMap<i64, Vec<SeccompRule>> = FORBIDDEN.iter().map(|call| (*call, Vec::new())).collect();
    // A thread that aborts signals itself, and limits of oneself have the number 0.
    let own = u64::from(std::process::id());
    rules.extend(
        [of_others(libc::SYS_tgkill, own), of_others(libc::SYS_prlimit64, 0)]
            .into_iter()
            .collect::<io::Result<Vec<_>>>()?,
    );
    let arch = std::env::consts::ARCH.try_into().map_err(io::Error::other)?;
    let refuse = SeccompAction::Errno(rustix::io::Errno::PERM.raw_os_error().unsigned_abs());
    let filter = SeccompFilter::new(rules, SeccompAction::Allow, refuse, arch).map_err(io::Error::other)?;
    let program: BpfProgram = filter.try_into().map_err(io::Error::other)?;
    seccompiler::apply_filter(&program).map_err(io::Error::other)
}

/// To sockets, to other programs, to other processes, to the kernel's inside.
#[cfg(target_os = "linux")]
const FORBIDDEN: &[i64] = &[
    libc::SYS_socket,
    libc::SYS_socketpair,
    libc::SYS_connect,
    libc::SYS_bind,
    libc::SYS_listen,
    libc::SYS_accept,
    libc::SYS_accept4,
    libc::SYS_execve,
    libc::SYS_execveat,
    libc::SYS_ptrace,
    libc::SYS_process_vm_readv,
    libc::SYS_process_vm_writev,
    libc::SYS_kill,
    libc::SYS_tkill,
    libc::SYS_rt_sigqueueinfo,
    libc::SYS_rt_tgsigqueueinfo,
    libc::SYS_pidfd_open,
    libc::SYS_pidfd_getfd,
    libc::SYS_pidfd_send_signal,
    libc::SYS_mount,
    libc::SYS_umount2,
    libc::SYS_unshare,
    libc::SYS_setns,
    libc::SYS_pivot_root,
    libc::SYS_chroot,
    libc::SYS_bpf,
    libc::SYS_perf_event_open,
    libc::SYS_userfaultfd,
    libc::SYS_io_uring_setup,
    libc::SYS_keyctl,
    libc::SYS_add_key,
    libc::SYS_request_key,
    libc::SYS_init_module,
    libc::SYS_finit_module,
    libc::SYS_kexec_load,
    libc::SYS_reboot,
    libc::SYS_swapon,
    libc::SYS_open_by_handle_at,
    libc::SYS_mknodat,
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_missing_is_named() {
        assert_eq!(Sandbox::default().missing(), ["no_new_privs", "Landlock", "seccomp"], "nothing is on");
        let all = Sandbox { gains_no_privileges: true, has_no_files: true, has_no_sockets: true };
        assert!(all.missing().is_empty(), "all are on");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn files_sockets_programs_and_processes_are_out_of_reach() {
        let parent = rustix::process::getppid().expect("a parent");
        let file = tempfile::NamedTempFile::new().expect("a file");
        // Locks are of one thread and those that it starts.
        let locked = std::thread::spawn(move || {
            let sandbox = enter();
            let reads = std::fs::read(file.path()).is_ok();
            let writes = std::fs::write(file.path(), "x").is_ok();
            let makes = std::fs::write(file.path().with_extension("new"), "x").is_ok();
            let connects = std::net::UdpSocket::bind("127.0.0.1:0").is_ok();
            let starts = std::process::Command::new("/bin/true").status().is_ok();
            let signals = rustix::process::test_kill_process(parent).is_ok();
            let spawns = std::thread::spawn(|| vec![1_u8; 1 << 20].len()).join().is_ok();
            (sandbox, [reads, writes, makes], [connects, starts, signals], spawns)
        });
        let (sandbox, files, calls, spawns) = locked.join().expect("no panic");
        assert!(spawns, "threads and memory are left");
        assert!(sandbox.gains_no_privileges, "every kernel has this");
        assert_eq!(files, [!sandbox.has_no_files; 3], "reading, writing and making files with {sandbox:?}");
        assert_eq!(calls, [!sandbox.has_no_sockets; 3], "sockets, programs and signals with {sandbox:?}");
    }
}
