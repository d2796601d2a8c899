//! Signing keys on disk: where they are, who may read them, and how they are written.
//!
//! A key is never part of an error, whatever is wrong with its file.
//!
//! A service whose user may not read the file gets it from systemd by `LoadCredential=`: a copy of
//! its own, in a directory that the environment names. A key whose file has the name of such a
//! credential is read from there, so that one configuration holds inside and outside the service.

use std::env;
use std::fmt;
use std::fs::{self, File};
use std::io::{self, Read};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use data_encoding::{BASE64, BASE64_NOPAD, HEXLOWER_PERMISSIVE};
use zeroize::Zeroizing;

use super::endpoint::EndpointConfig;
use super::suggest;
use crate::mavlink::{KEY_LEN, Key};

/// How large a key file may be, in bytes: a passphrase may be long.
pub const MAX_LEN: u64 = 4_096;

/// Where systemd says which directory has the credentials of a service.
const CREDENTIALS: &str = "CREDENTIALS_DIRECTORY";

/// What a passphrase begins with.
const PASSPHRASE: &str = "passphrase:";

/// A key that has a name, as the user configured it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct KeyFile {
    /// By which the options of endpoints speak of it.
    pub name: String,
    /// Where it is.
    pub path: PathBuf,
    /// The key itself, once its file was read by [`read_keys`].
    pub key: Option<Key>,
}

/// `radio=/etc/mavswitch/radio.key`
impl fmt::Display for KeyFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.name, self.path.display())
    }
}

/// A key that an option names.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct KeyRef {
    /// Its name.
    pub name: String,
    /// The key itself, once its file was read.
    pub key: Option<Key>,
}

/// Why a key cannot be had.
#[derive(Debug, thiserror::Error)]
pub enum KeyError {
    /// An option names a key that there is not.
    #[error("no key is called `{0}`: {1}")]
    Unknown(String, String),
    /// Its file cannot be read.
    #[error("key `{0}`: cannot read {1}: {2}")]
    Read(String, PathBuf, io::Error),
    /// Its file is something else, such as a directory.
    #[error("key `{0}`: {1} is no file")]
    NoFile(String, PathBuf),
    /// Its file may be read by others than its owner.
    #[error("key `{0}`: {1} is open to others than its owner (mode {2:03o}): chmod 600 {1}")]
    Open(String, PathBuf, u32),
    /// What is in its file is no key.
    #[error(
        "key `{0}`: {1} has no key: write 32 bytes as they are, in hexadecimal or in base64, or a \
         passphrase behind the word `passphrase:`"
    )]
    Content(String, PathBuf),
}

/// Gives an endpoint the keys that it names, of those that were read by [`read_keys`].
///
/// # Errors
///
/// The option that names a key which cannot be had, and why. The other option has its key.
pub fn load_keys(
    endpoint: &mut EndpointConfig,
    files: &[KeyFile],
) -> Result<(), Vec<(&'static str, KeyError)>> {
    let options = &mut endpoint.options;
    let mut errors = Vec::new();
    for (option, named) in [("sign", &mut options.sign), ("verify", &mut options.verify)] {
        let Some(named) = named else { continue };
        match find_key(&named.name, files) {
            Ok(key) => named.key = Some(key),
            Err(error) => errors.push((option, error)),
        }
    }
    if errors.is_empty() { Ok(()) } else { Err(errors) }
}

/// Reads all keys, each once: all endpoints have the same one then, also one that comes later. One
/// that cannot be had is left out, as perhaps no endpoint asks for it.
pub fn read_keys(files: &mut [KeyFile]) {
    for file in files {
        file.key = read_key(file).ok();
    }
}

/// The keys that no endpoint of `endpoints` names, and why one cannot be had if [`read_keys`] could
/// not read it.
pub fn unused_keys<'a>(
    endpoints: &[&EndpointConfig],
    files: &'a [KeyFile],
) -> Vec<(&'a KeyFile, Option<KeyError>)> {
    let options = endpoints.iter().map(|endpoint| &endpoint.options);
    let named: Vec<&KeyRef> = options.flat_map(|it| [&it.sign, &it.verify]).flatten().collect();
    let is_unused = |file: &&KeyFile| named.iter().all(|key| key.name != file.name);
    files.iter().filter(is_unused).map(|file| (file, key_of_file(file).err())).collect()
}

fn find_key(name: &str, files: &[KeyFile]) -> Result<Key, KeyError> {
    let Some(file) = files.iter().find(|file| file.name == name) else {
        let hint = match suggest::nearest(name, files.iter().map(|file| file.name.as_str())) {
            Some(near) => format!("did you mean `{near}`?"),
            None => "say where it is, with `keys` in a configuration file or with --key".to_owned(),
        };
        return Err(KeyError::Unknown(name.to_owned(), hint));
    };
    key_of_file(file)
}

/// The key that was read, or why it was not.
fn key_of_file(file: &KeyFile) -> Result<Key, KeyError> {
    file.key.clone().map_or_else(|| read_key(file), Ok)
}

fn read_key(file: &KeyFile) -> Result<Key, KeyError> {
    let credentials = env::var_os(CREDENTIALS).map(PathBuf::from);
    read_key_or_credential(file, credentials.as_deref())
}

fn read_key_or_credential(file: &KeyFile, credentials: Option<&Path>) -> Result<Key, KeyError> {
    let KeyFile { name, path, .. } = file;
    let (path, forbidden) = match credential(path, credentials) {
        // Some systems give it to the service's user by an access list, which shows as 0440: then
        // nobody but systemd and that user can enter the directory.
        Some(path) => (path, 0o037),
        None => (path.clone(), 0o077),
    };
    let bytes = read_private(name, &path, forbidden)?;
    parse_key(&bytes).ok_or_else(|| KeyError::Content(name.clone(), path))
}

/// The credential of the same name, if there is one.
fn credential(path: &Path, credentials: Option<&Path>) -> Option<PathBuf> {
    let credential = credentials?.join(path.file_name()?);
    credential.exists().then_some(credential)
}

/// What is in a file that has none of the `forbidden` bits in its mode.
fn read_private(name: &str, path: &Path, forbidden: u32) -> Result<Zeroizing<Vec<u8>>, KeyError> {
    let unreadable = |error| KeyError::Read(name.to_owned(), path.to_owned(), error);
    // Before it is opened: a pipe would wait for somebody to write.
    if !fs::metadata(path).map_err(unreadable)?.is_file() {
        return Err(KeyError::NoFile(name.to_owned(), path.to_owned()));
    }
    let file = File::open(path).map_err(unreadable)?;
    // Of the file that is open now, whatever has the name since.
    let mode = file.metadata().map_err(unreadable)?.permissions().mode() & 0o777;
    if mode & forbidden != 0 {
        return Err(KeyError::Open(name.to_owned(), path.to_owned(), mode));
    }
    // With all its room from the start: growing would leave a copy behind.
    let mut bytes = Zeroizing::new(Vec::with_capacity(MAX_LEN as usize + 1));
    file.take(MAX_LEN + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    Ok(bytes)
}

/// The key that stands in a file, if one does.
fn parse_key(bytes: &[u8]) -> Option<Key> {
    if bytes.len() as u64 > MAX_LEN {
        return None;
    }
    // Thirty-two letters are a passphrase whose mark was forgotten.
    let is_text = bytes.iter().all(|byte| matches!(byte, b' '..=b'~' | b'\n' | b'\r'));
    if bytes.len() == KEY_LEN && !is_text {
        return key_of(bytes);
    }
    let text = std::str::from_utf8(bytes).ok()?;
    if let Some(passphrase) = text.strip_prefix(PASSPHRASE) {
        let passphrase = passphrase.trim_end_matches(['\n', '\r']);
        return (!passphrase.is_empty()).then(|| Key::from_passphrase(passphrase));
    }
    let text = text.trim().as_bytes();
    let decoders = [&HEXLOWER_PERMISSIVE, &BASE64, &BASE64_NOPAD];
    let decoded = decoders.into_iter().filter_map(|it| it.decode(text).ok().map(Zeroizing::new));
    decoded.into_iter().find_map(|bytes| key_of(&bytes))
}

fn key_of(bytes: &[u8]) -> Option<Key> {
    let bytes: &[u8; KEY_LEN] = bytes.try_into().ok()?;
    Key::new(Zeroizing::new(*bytes))
}

/// For a fuzzer: reads a key file.
pub fn fuzz_key(data: &[u8]) {
    let key = parse_key(data);
    if data.len() == KEY_LEN && data.iter().any(|byte| *byte > b'~') {
        assert!(key.is_some());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_dir::TestDir;

    const RAW: [u8; 32] = [0xa5; 32];

    fn raw() -> Option<Key> {
        Key::new(Zeroizing::new(RAW))
    }

    #[test]
    fn a_key_is_32_bytes_in_any_spelling_or_a_passphrase() {
        assert!(parse_key(&RAW) == raw());
        assert!(parse_key("a5".repeat(32).as_bytes()) == raw());
        assert!(parse_key(format!("{}\n", "A5".repeat(32)).as_bytes()) == raw());
        let base64 = BASE64.encode(&RAW);
        assert!(parse_key(format!("{base64}\r\n").as_bytes()) == raw());
        assert!(parse_key(base64.trim_end_matches('=').as_bytes()) == raw());
        let passphrase = Some(Key::from_passphrase("my dog"));
        assert!(parse_key(b"passphrase:my dog\n") == passphrase);
        assert!(parse_key(b"passphrase:my dog\r\n") == passphrase);
        assert!(parse_key(b"passphrase: my dog") != passphrase);
    }

    #[test]
    fn what_is_no_key_is_none() {
        let long = vec![b'a'; 5_000];
        let none: [&[u8]; 9] = [
            b"",
            b"passphrase:",
            b"passphrase:\n",
            b"a5a5",
            &[0; 32],
            &[0xa5; 31],
            &[0xa5; 33],
            b"this is a passphrase of mine 32b",
            &long,
        ];
        for bytes in none {
            assert!(parse_key(bytes).is_none(), "{bytes:?}");
        }
        assert!(parse_key("00".repeat(32).as_bytes()).is_none());
    }

    #[test]
    fn exercise_fuzz_key() {
        for data in [&RAW[..], b"passphrase:\xff", b"a5", "\u{e4}".repeat(32).as_bytes()] {
            fuzz_key(data);
        }
    }

    fn loaded(files: &[KeyFile]) -> Result<(), Vec<(&'static str, KeyError)>> {
        load_keys(&mut "udpin::1?sign=radio".parse().unwrap(), files)
    }

    #[test]
    fn a_key_that_others_may_read_is_refused() {
        let dir = TestDir::new();
        let path = dir.write("radio.key", "a5".repeat(32));
        let files = [KeyFile { name: "radio".into(), path: path.clone(), key: None }];
        for mode in [0o644, 0o640, 0o604, 0o620] {
            fs::set_permissions(&path, fs::Permissions::from_mode(mode)).unwrap();
            let errors = loaded(&files).unwrap_err();
            let shown = path.display();
            let text = format!(
                "key `radio`: {shown} is open to others than its owner (mode {mode:03o}): chmod 600 {shown}"
            );
            assert_eq!((errors[0].0, errors[0].1.to_string()), ("sign", text));
        }
        fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).unwrap();
        loaded(&files).unwrap();
    }

    #[test]
    fn a_key_that_the_service_manager_hands_over_is_read_from_there() {
        let (dir, credentials) = (TestDir::new(), TestDir::new());
        let radio = |path| KeyFile { name: "radio".into(), path, key: None };
        let file = radio(dir.write("radio.key", "only root can read this"));
        let given = credentials.write("radio.key", "a5".repeat(32));
        let within = given.parent();
        for mode in [0o400, 0o440, 0o600] {
            fs::set_permissions(&given, fs::Permissions::from_mode(mode)).unwrap();
            assert!(read_key_or_credential(&file, within).ok() == raw(), "{mode:o}");
            assert!(read_key_or_credential(&radio(given.clone()), within).ok() == raw());
        }
        for mode in [0o444, 0o460, 0o604] {
            fs::set_permissions(&given, fs::Permissions::from_mode(mode)).unwrap();
            let error = read_key_or_credential(&file, within).unwrap_err();
            assert!(matches!(error, KeyError::Open(..)), "{error}");
        }
        // Credentials of other names are no matter to it.
        let other = radio(dir.write("other.key", "a5".repeat(32)));
        fs::set_permissions(&other.path, fs::Permissions::from_mode(0o440)).unwrap();
        let error = read_key_or_credential(&other, within).unwrap_err();
        assert!(matches!(error, KeyError::Open(..)), "{error}");
    }

    #[test]
    fn keys_are_read_once_as_far_as_they_can_be() {
        let dir = TestDir::new();
        let file = |name: &str, mode| {
            let path = dir.write(name, "a5".repeat(32));
            fs::set_permissions(&path, fs::Permissions::from_mode(mode)).unwrap();
            KeyFile { name: name.to_owned(), path, key: None }
        };
        let mut files = [file("closed", 0o600), file("open", 0o644)];
        read_keys(&mut files);
        assert!(files[0].key == raw() && files[1].key.is_none());
        let unused: Vec<_> = unused_keys(&[], &files).into_iter().map(|(_, error)| error).collect();
        assert!(matches!(&unused[..], [None, Some(KeyError::Open(..))]), "{unused:?}");
        // Whatever becomes of the file, an endpoint has the key that was read.
        fs::remove_file(&files[0].path).unwrap();
        let mut endpoint: EndpointConfig = "udpin::1?sign=closed&verify=closed".parse().unwrap();
        load_keys(&mut endpoint, &files).unwrap();
        assert!(
            [endpoint.options.sign, endpoint.options.verify].map(|it| it.unwrap().key)
                == [raw(), raw()]
        );
    }

    #[test]
    fn what_is_wrong_with_a_key_is_told_with_a_remedy() {
        let tell = |name: &str, path: &str| {
            let errors =
                loaded(&[KeyFile { name: name.into(), path: path.into(), key: None }]).unwrap_err();
            errors[0].1.to_string()
        };
        assert_eq!(tell("radios", "x"), "no key is called `radio`: did you mean `radios`?");
        assert!(tell("lte", "x").ends_with("with `keys` in a configuration file or with --key"));
        assert!(
            tell("radio", "/nowhere/x").starts_with("key `radio`: cannot read /nowhere/x: No such")
        );
        assert_eq!(tell("radio", "/"), "key `radio`: / is no file");
    }
}
