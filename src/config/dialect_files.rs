//! Definition files on disk: reads a dialect with all that it includes.
//!
//! Owns the files and their limits; what their text means is for [`parse_definitions`] to say.

use std::collections::{HashMap, HashSet};
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use crate::mavlink::{Definition, DefinitionError, Definitions, MAX_MESSAGES, parse_definitions};

/// How many files a dialect may consist of; the largest published one has 19.
const MAX_FILES: usize = 64;
/// How large each of them may be, in bytes; the largest published one has 0.6 MiB.
const MAX_FILE_LEN: u64 = 16 << 20;

/// Why a dialect cannot be loaded.
///
/// Each names the file as a chain: `a.xml, included by b.xml, included by c.xml`.
#[derive(Debug, thiserror::Error)]
pub enum DialectFileError {
    /// A file cannot be read.
    #[error("cannot read {file}: {error}")]
    Read {
        /// The chain.
        file: String,
        /// What the system says.
        error: io::Error,
    },
    /// A file is larger than any definition file.
    #[error("{file}: larger than {} MiB (is this a MAVLink definition file?)", MAX_FILE_LEN >> 20)]
    TooLarge {
        /// The chain.
        file: String,
    },
    /// A file that another one includes is not there.
    #[error("cannot find {file} (put it beside the file that includes it)")]
    Missing {
        /// The chain.
        file: String,
    },
    /// Includes lead to more and more files.
    #[error("{file}: one file more than the {MAX_FILES} a dialect may have (include fewer)")]
    TooManyFiles {
        /// The chain.
        file: String,
    },
    /// The files together have more messages than this program takes.
    #[error("{file}: with this file more than {MAX_MESSAGES} messages (include fewer)")]
    TooManyMessages {
        /// The chain.
        file: String,
    },
    /// A file's text is no usable definition file.
    #[error("{file}: {error}")]
    Content {
        /// The chain.
        file: String,
        /// What is wrong, and in which line.
        error: DefinitionError,
    },
}

/// Reads the definition file at `path` and all it includes, directly or not, each file once.
///
/// Includes are looked for beside the file that names them; that files include each other is fine.
/// Definitions of an including file stand before those of the files it includes, so that it has
/// the last word on what an id means (`Dialect::add`: the first wins). No (id, CRC_EXTRA) is there
/// twice; there are at most [`MAX_MESSAGES`] definitions.
///
/// # Errors
///
/// See [`DialectFileError`].
pub fn load_dialect(path: &Path) -> Result<Vec<Definition>, DialectFileError> {
    let files = Files::load(path)?;
    let mut seen = HashSet::new();
    let mut definitions = Vec::new();
    for file in files.including_first() {
        let new = |message: &&Definition| seen.insert(message.key());
        definitions.extend(files.list[file].found.messages.iter().filter(new).cloned());
        if definitions.len() > MAX_MESSAGES {
            let file = files.chain(file);
            return Err(DialectFileError::TooManyMessages { file });
        }
    }
    Ok(definitions)
}

/// The same for somebody who wants to read payloads: what each file says, in that order.
///
/// # Errors
///
/// See [`DialectFileError`].
pub fn load_layouts(path: &Path) -> Result<Vec<Definitions>, DialectFileError> {
    let mut files = Files::load(path)?;
    let order = files.including_first();
    Ok(order.into_iter().map(|file| std::mem::take(&mut files.list[file].found)).collect())
}

/// The files of one dialect.
#[derive(Default)]
struct Files {
    /// In the order they were found; the first is the one that the user named.
    list: Vec<SourceFile>,
    /// Where in `list` a file is, by its real path.
    by_real_path: HashMap<PathBuf, usize>,
}

struct SourceFile {
    path: PathBuf,
    /// The first file that includes this one.
    included_by: Option<usize>,
    /// What it says itself, all but its includes.
    found: Definitions,
    includes: Vec<usize>,
}

impl Files {
    fn load(path: &Path) -> Result<Self, DialectFileError> {
        let mut files = Self::default();
        files.find(path.to_owned(), None)?;
        let mut next = 0;
        while next < files.list.len() {
            files.read(next)?;
            next += 1;
        }
        Ok(files)
    }

    /// The place of a file in the list; it joins the list when it is new.
    fn find(
        &mut self,
        path: PathBuf,
        included_by: Option<usize>,
    ) -> Result<usize, DialectFileError> {
        let real_path = fs::canonicalize(&path);
        let known = real_path.as_ref().map(|real| self.by_real_path.get(real));
        if let Ok(Some(known)) = known {
            return Ok(*known);
        }
        let place = self.list.len();
        self.list.push(SourceFile {
            path,
            included_by,
            found: Definitions::default(),
            includes: Vec::new(),
        });
        let real_path = real_path.map_err(|error| self.cannot_read(place, error))?;
        if place == MAX_FILES {
            let file = self.chain(place);
            return Err(DialectFileError::TooManyFiles { file });
        }
        self.by_real_path.insert(real_path, place);
        Ok(place)
    }

    fn read(&mut self, place: usize) -> Result<(), DialectFileError> {
        let path = self.list[place].path.clone();
        let bytes = read_bounded(&path).map_err(|error| self.cannot_read(place, error))?;
        let file = || self.chain(place);
        let bytes = bytes.ok_or_else(|| DialectFileError::TooLarge { file: file() })?;
        // Names are ASCII; a description in another encoding must not keep a dialect out.
        let text = String::from_utf8_lossy(&bytes);
        let mut found = parse_definitions(&text)
            .map_err(|error| DialectFileError::Content { file: file(), error })?;
        let includes = std::mem::take(&mut found.includes);
        self.list[place].found = found;
        for include in includes {
            let included = self.find(path.with_file_name(include), Some(place))?;
            self.list[place].includes.push(included);
        }
        Ok(())
    }

    fn cannot_read(&self, place: usize, error: io::Error) -> DialectFileError {
        let file = self.chain(place);
        let is_included = self.list[place].included_by.is_some();
        if is_included && error.kind() == io::ErrorKind::NotFound {
            return DialectFileError::Missing { file };
        }
        DialectFileError::Read { file, error }
    }

    /// How the user's file leads to this one.
    fn chain(&self, place: usize) -> String {
        let mut chain = shown(&self.list[place].path);
        let mut file = place;
        while let Some(by) = self.list[file].included_by {
            chain = chain + ", included by " + &shown(&self.list[by].path);
            file = by;
        }
        chain
    }

    /// Every file before the files it includes, and else in the order of the includes. Of files
    /// that include each other, in circles, any may be first, but the user's own is before all.
    fn including_first(&self) -> Vec<usize> {
        enum Visit {
            Enter(usize),
            Leave(usize),
        }
        let mut order = Vec::new();
        let mut entered = vec![false; self.list.len()];
        let mut visits = vec![Visit::Enter(0)];
        while let Some(visit) = visits.pop() {
            match visit {
                Visit::Enter(file) if entered[file] => {}
                Visit::Enter(file) => {
                    entered[file] = true;
                    visits.push(Visit::Leave(file));
                    visits.extend(self.list[file].includes.iter().copied().map(Visit::Enter));
                }
                Visit::Leave(file) => order.push(file),
            }
        }
        // A file is left after all it includes.
        order.reverse();
        order
    }
}

/// The file's bytes; none if it is longer than [`MAX_FILE_LEN`].
fn read_bounded(path: &Path) -> io::Result<Option<Vec<u8>>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(MAX_FILE_LEN + 1).read_to_end(&mut bytes)?;
    Ok((bytes.len() as u64 <= MAX_FILE_LEN).then_some(bytes))
}

/// A path, parts of which a file may have given, fit for a message.
fn shown(path: &Path) -> String {
    /// No system opens a longer path.
    const MOST: usize = 4096;
    let printable = |c: char| if c.is_control() { '?' } else { c };
    let path = path.display().to_string();
    path.chars().take(MOST).map(printable).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mavlink::{Dialect, MessageId};
    use crate::test_dir::TestDir;

    /// A directory with message definitions.
    struct Dir(TestDir);

    impl Dir {
        fn new() -> Self {
            let dir = TestDir::new();
            fs::create_dir(dir.path().join("sub")).unwrap();
            Self(dir)
        }

        /// A file that includes `includes` and has a message of each (id, field).
        fn write(&self, file: &str, includes: &[&str], messages: &[(u32, &str)]) {
            let mut xml = String::from("<mavlink>\n");
            for include in includes {
                xml += &format!("<include>{include}</include>\n");
            }
            xml += "<messages>\n";
            for (id, field) in messages {
                xml += &format!("<message id=\"{id}\" name=\"M{id}\">");
                xml += &format!("<field type=\"uint8_t\" name=\"{field}\"/></message>\n");
            }
            self.0.write(file, xml + "</messages></mavlink>");
        }

        fn load(&self, file: &str) -> Result<Vec<Definition>, DialectFileError> {
            load_dialect(&self.0.path().join(file))
        }

        /// The error of a load, without the path of the directory.
        fn error(&self, file: &str) -> String {
            let error = self.load(file).unwrap_err().to_string();
            error.replace(&format!("{}/", self.0.path().display()), "")
        }
    }

    #[test]
    fn each_file_is_read_once_and_an_including_file_has_the_last_word() {
        let dir = Dir::new();
        // Included before the middle file, the base still comes after it; the base includes the first.
        dir.write("own.xml", &["base.xml", "sub/mid.xml", "own.xml"], &[(1, "own")]);
        dir.write("sub/mid.xml", &["../base.xml"], &[(2, "mid"), (1, "mid")]);
        dir.write("base.xml", &["sub/../own.xml"], &[(3, "base"), (2, "base"), (1, "own")]);
        let definitions = dir.load("own.xml").unwrap();
        let ids: Vec<u32> = definitions.iter().map(|message| message.id.0).collect();
        // Own, middle, base; what the base says of 1 has been said by the first.
        assert_eq!(ids, [1, 2, 1, 3, 2]);

        let mut dialect = Dialect::builtin();
        dialect.add(definitions.clone()).unwrap();
        assert_eq!(dialect.by_id(MessageId(1)), Some(&definitions[0]));
        assert_eq!(dialect.by_id(MessageId(2)), Some(&definitions[1]));
        for definition in &definitions {
            let (id, extra) = definition.key();
            assert_eq!(dialect.by_pair(id, extra), Some(definition));
        }
    }

    #[test]
    fn an_error_names_the_way_to_the_file() {
        let dir = Dir::new();
        dir.write("a.xml", &["sub/b.xml"], &[]);
        dir.write("sub/b.xml", &["c\n.xml"], &[]);
        let chain = "sub/b.xml, included by a.xml";
        let missing = "(put it beside the file that includes it)";
        let message = format!("cannot find sub/c?.xml, included by {chain} {missing}");
        assert_eq!(dir.error("a.xml"), message);

        let message = "cannot read no.xml: No such file or directory (os error 2)";
        assert_eq!(dir.error("no.xml"), message);
        dir.write("a.xml", &["sub"], &[]);
        let message = "cannot read sub, included by a.xml: Is a directory (os error 21)";
        assert_eq!(dir.error("a.xml"), message);

        dir.write("a.xml", &["sub/b.xml"], &[]);
        dir.write("sub/b.xml", &[], &[(70_000, "f"), (70_000, "g")]);
        let problem = "message M70000 has the id 70000 of message M70000";
        let message = format!("{chain}: line 4: {problem} (give one of them another id)");
        assert_eq!(dir.error("a.xml"), message);
    }

    #[test]
    fn files_messages_and_bytes_are_bounded() {
        let dir = Dir::new();
        for file in 0..MAX_FILES {
            let next = format!("{}.xml", file + 1);
            dir.write(&format!("{file}.xml"), &[&next], &[]);
        }
        dir.write("64.xml", &[], &[]);
        assert!(dir.load("1.xml").is_ok());
        let error = dir.error("0.xml");
        assert!(error.starts_with("64.xml, included by 63.xml, included by 62.xml"));
        let problem = "one file more than the 64 a dialect may have (include fewer)";
        assert!(error.ends_with(&format!(", included by 0.xml: {problem}")));

        let many: Vec<(u32, &str)> = (0..4096).map(|id| (id, "f")).collect();
        dir.write("many.xml", &[], &many);
        dir.write("more.xml", &["many.xml"], &[(4096, "f")]);
        assert_eq!(dir.load("many.xml").unwrap().len(), MAX_MESSAGES);
        let problem = "with this file more than 4096 messages (include fewer)";
        let message = format!("many.xml, included by more.xml: {problem}");
        assert_eq!(dir.error("more.xml"), message);

        let large = File::create(dir.0.path().join("large.xml")).unwrap();
        large.set_len(MAX_FILE_LEN + 1).unwrap();
        let problem = "larger than 16 MiB (is this a MAVLink definition file?)";
        assert_eq!(dir.error("large.xml"), format!("large.xml: {problem}"));
    }

    #[test]
    fn a_description_in_another_encoding_keeps_no_dialect_out() {
        let dir = Dir::new();
        let xml =
            b"<mavlink><!-- \xe9 --><messages><message id='9' name='M'/></messages></mavlink>";
        dir.0.write("latin.xml", xml);
        assert_eq!(dir.load("latin.xml").unwrap().len(), 1);
    }
}
