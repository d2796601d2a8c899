//! The file of the control socket: made for one daemon at a time, and gone with it.

use std::fs::{self, DirBuilder, Permissions};
use std::io::{self, ErrorKind};
use std::os::fd::OwnedFd;
use std::os::unix::fs::{DirBuilderExt, FileTypeExt, MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};

use mio::net::{UnixListener, UnixStream};
use mio::{Interest, Registry, Token};
use socket2::{Domain, SockAddr, Socket, Type};

/// Who may connect: the user and the group of the daemon.
const MODE: u32 = 0o660;

/// How many may wait to be accepted.
const BACKLOG: i32 = 16;

/// A socket that listens, and its file.
#[derive(Debug)]
pub(super) struct ControlSocket {
    listener: UnixListener,
    path: PathBuf,
    /// The device and number of the file: another daemon may have put its own in its place.
    file: (u64, u64),
}

impl ControlSocket {
    /// Makes a socket at `path`, in place of one that nobody listens to.
    ///
    /// # Errors
    ///
    /// If somebody does listen there, or if it cannot be made; with what to do about it.
    pub(super) fn open(path: &Path, registry: &Registry, token: Token) -> io::Result<Self> {
        make_directory(path)?;
        remove_stale(path)?;
        let mut listener = bind(path).map_err(|error| explained(&error))?;
        registry.register(&mut listener, token, Interest::READABLE)?;
        let metadata = fs::symlink_metadata(path)?;
        let file = (metadata.dev(), metadata.ino());
        Ok(Self { listener, path: path.to_owned(), file })
    }

    /// Somebody who has connected.
    pub(super) fn accept(&self) -> io::Result<UnixStream> {
        self.listener.accept().map(|(stream, _)| stream)
    }
}

impl Drop for ControlSocket {
    fn drop(&mut self) {
        let is_ours = fs::symlink_metadata(&self.path)
            .is_ok_and(|metadata| (metadata.dev(), metadata.ino()) == self.file);
        if is_ours {
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// The directory of a user's sockets is made as it is first needed, for that user alone.
fn make_directory(path: &Path) -> io::Result<()> {
    let Some(directory) = path.parent() else { return Ok(()) };
    if directory.ends_with("mavswitch") && !directory.exists() {
        DirBuilder::new().mode(0o750).create(directory).map_err(|error| explained(&error))?;
    }
    Ok(())
}

/// Removes what a daemon has left behind that did not end by itself.
fn remove_stale(path: &Path) -> io::Result<()> {
    let Ok(metadata) = fs::symlink_metadata(path) else { return Ok(()) };
    if !metadata.file_type().is_socket() {
        return Err(io::Error::other("another file is there (remove it, or use --control PATH)"));
    }
    // This waits for nothing: one that is alive and busy is told from one that is dead all the same.
    match UnixStream::connect(path) {
        Err(error) if error.kind() == ErrorKind::ConnectionRefused => fs::remove_file(path),
        Err(error) if error.kind() == ErrorKind::PermissionDenied => Err(explained(&error)),
        _ => Err(io::Error::other(
            "another mavswitch has it (give this one another place, --control PATH, or --control off)",
        )),
    }
}

fn bind(path: &Path) -> io::Result<UnixListener> {
    let socket = Socket::new(Domain::UNIX, Type::STREAM.nonblocking().cloexec(), None)?;
    // The file gets the mode of the socket: at no time may others connect.
    rustix::fs::fchmod(&socket, rustix::fs::Mode::from_raw_mode(MODE))?;
    socket.bind(&SockAddr::unix(path)?)?;
    // The user's mask may have taken the group away.
    fs::set_permissions(path, Permissions::from_mode(MODE))?;
    socket.listen(BACKLOG)?;
    let listener = std::os::unix::net::UnixListener::from(OwnedFd::from(socket));
    Ok(UnixListener::from_std(listener))
}

fn explained(error: &io::Error) -> io::Error {
    let remedy = match error.kind() {
        ErrorKind::NotFound => "make its directory, or use --control PATH",
        ErrorKind::PermissionDenied => "use --control PATH with a directory of your own",
        ErrorKind::InvalidInput => "a path of at most 107 bytes is possible: use --control PATH",
        _ => "use --control PATH for another place, or --control off",
    };
    io::Error::other(format!("{error} ({remedy})"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_dir::TestDir;
    use mio::Poll;

    fn open(path: &Path) -> io::Result<ControlSocket> {
        let poll = Poll::new().unwrap();
        ControlSocket::open(path, poll.registry(), Token(0))
    }

    #[test]
    fn user_and_group_may_connect_and_the_file_goes_with_the_daemon() {
        let dir = TestDir::new();
        let path = dir.path().join("control");
        let socket = open(&path).unwrap();
        let mode = fs::symlink_metadata(&path).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, MODE);
        drop(socket);
        assert!(!path.exists());
    }

    #[test]
    fn what_the_dead_have_left_is_replaced_and_what_the_living_have_is_not() {
        let dir = TestDir::new();
        let path = dir.path().join("control");
        // It never listened: a listener lives on in a process that is being forked just now.
        let dead = Socket::new(Domain::UNIX, Type::STREAM, None).unwrap();
        dead.bind(&SockAddr::unix(&path).unwrap()).unwrap();
        drop(dead);
        let first = open(&path).unwrap();
        let refusal = open(&path).unwrap_err().to_string();
        assert!(refusal.contains("another mavswitch"), "{refusal}");
        assert!(path.exists());
        drop(first);
        fs::write(&path, "precious").unwrap();
        let refusal = open(&path).unwrap_err().to_string();
        assert!(refusal.contains("another file"), "{refusal}");
        assert_eq!(fs::read(&path).unwrap(), b"precious");
    }

    #[test]
    fn one_that_was_replaced_leaves_its_successor_alone() {
        let dir = TestDir::new();
        let path = dir.path().join("control");
        let first = open(&path).unwrap();
        fs::remove_file(&path).unwrap();
        let _second = open(&path).unwrap();
        drop(first);
        assert!(path.exists());
    }

    #[test]
    fn a_place_that_cannot_be_is_told_with_what_to_do() {
        let refusal = open(Path::new("/nowhere/at/all/control")).unwrap_err().to_string();
        assert!(refusal.contains("make its directory"), "{refusal}");
        let long = format!("/tmp/{}", "x".repeat(200));
        let refusal = open(Path::new(&long)).unwrap_err().to_string();
        assert!(refusal.contains("--control PATH"), "{refusal}");
    }
}
