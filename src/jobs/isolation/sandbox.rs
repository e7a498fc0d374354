//! What an engine process gives up before it reads anything: files, sockets, other programs, other processes.
//!
//! A decoder that somebody has taken over may then use up memory and time, and answer nonsense; it reaches neither the database nor the
//! network. Each lock is of the kernel's, and not every kernel has each: what is missing is told to the parent, which says so in its log.

use std::io;

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
    use seccompiler::{BpfProgram, SeccompAction, SeccompFilter};
    let rules = FORBIDDEN.iter().map(|call| (*call, Vec::new())).collect();
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
}
