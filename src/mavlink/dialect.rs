//! The message table: every (message id, CRC_EXTRA) pair ever published, and the user's own.
//!
//! The key is the pair, not the id: ids were given new meanings over the years, and the CRC_EXTRA
//! that a frame was made with tells which meaning it has (rule 25). So no dialect is configured,
//! and the 2012 and 2015 message sets route right beside today's.

use std::borrow::Cow;

use super::id::MessageId;

/// One definition of a message: what a router must know of it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Definition {
    /// The message id.
    pub id: MessageId,
    /// The byte that closes the checksum; with the id, the key of the table (rule 16).
    pub crc_extra: u8,
    /// The name, as in the XML file: `HEARTBEAT`.
    pub name: Cow<'static, str>,
    /// Payload length without extension fields: 0..=255, more in four retired definitions.
    pub base_len: u16,
    /// Payload length with all extension fields.
    pub max_len: u16,
    /// Where the target is.
    pub target: Target,
}

impl Definition {
    /// What tells this definition from all others.
    pub fn key(&self) -> (MessageId, u8) {
        (self.id, self.crc_extra)
    }
}

/// Where in the payload a message says whom it is for (rules 27-32).
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Target {
    /// It does not: the message is a broadcast.
    None,
    /// Only a system, at this offset.
    System(u8),
    /// A system and a component, at these offsets.
    SystemComponent(u8, u8),
}

/// How many definitions a table holds at most.
pub const MAX_DEFINITIONS: usize = 30_000;

/// The table would hold more than [`MAX_DEFINITIONS`].
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("more than {MAX_DEFINITIONS} message definitions (load fewer files)")]
pub struct TooManyDefinitions;

/// The definitions that frames are checked against.
#[derive(Clone, Debug)]
pub struct Dialect {
    definitions: Vec<Definition>,
    /// Open addressing by (id, CRC_EXTRA): a number in `definitions`, or [`FREE`].
    ///
    /// Invariant: a power of two in length, and at most half full.
    by_pair: Vec<u16>,
    /// The same by id alone: the first definition of each id.
    by_id: Vec<u16>,
}

impl Dialect {
    /// The built-in table: everything ever published.
    pub fn builtin() -> Self {
        let mut dialect =
            Self { definitions: BUILTIN.to_vec(), by_pair: Vec::new(), by_id: Vec::new() };
        dialect.index();
        dialect
    }

    /// Adds `definitions`; one with the same (id, CRC_EXTRA) takes the place of the old one.
    ///
    /// Two definitions of one pair can differ in their extension fields only, and those are at the
    /// end: the longer one reads the frames of both (rule 10), so it is kept. An old copy of a
    /// published file thus takes no target away.
    ///
    /// # Errors
    ///
    /// With more than [`MAX_DEFINITIONS`] in all; the table is then as it was.
    pub fn add(
        &mut self,
        definitions: impl IntoIterator<Item = Definition>,
    ) -> Result<(), TooManyDefinitions> {
        let longer = |new: Definition| match self.by_pair(new.id, new.crc_extra) {
            Some(old) if old.max_len > new.max_len => old.clone(),
            _ => new,
        };
        let mut all: Vec<Definition> = definitions.into_iter().map(longer).collect();
        let is_kept = |old: &&Definition| !all.iter().any(|new| new.key() == old.key());
        let kept: Vec<Definition> = self.definitions.iter().filter(is_kept).cloned().collect();
        all.extend(kept);
        if all.len() > MAX_DEFINITIONS {
            return Err(TooManyDefinitions);
        }
        self.definitions = all;
        self.index();
        Ok(())
    }

    /// The definition that a frame with this id and this CRC_EXTRA was made with.
    pub fn by_pair(&self, id: MessageId, crc_extra: u8) -> Option<&Definition> {
        self.find(&self.by_pair, pair_hash(id, crc_extra), |d| d.key() == (id, crc_extra))
    }

    /// What this id means today: the user's definition, else the current one, else a retired one.
    pub fn by_id(&self, id: MessageId) -> Option<&Definition> {
        self.find(&self.by_id, id_hash(id), |d| d.id == id)
    }

    /// The id of the message called `name`, in capitals. The first definition counts: the user's
    /// own, then today's.
    pub fn id_of(&self, name: &str) -> Option<MessageId> {
        let mut definitions = self.definitions.iter();
        definitions.find(|definition| definition.name == name).map(|definition| definition.id)
    }

    /// All definitions: the user's first, then for each id the current ones before the retired.
    pub fn definitions(&self) -> &[Definition] {
        &self.definitions
    }

    fn find(
        &self,
        index: &[u16],
        hash: u32,
        is_it: impl Fn(&Definition) -> bool,
    ) -> Option<&Definition> {
        let mask = index.len() - 1;
        let mut slot = hash as usize & mask;
        // Ends at a free slot: the index is at most half full.
        while index[slot] != FREE {
            let definition = &self.definitions[usize::from(index[slot])];
            if is_it(definition) {
                return Some(definition);
            }
            slot = (slot + 1) & mask;
        }
        None
    }

    fn index(&mut self) {
        let slots = (self.definitions.len() * 2).next_power_of_two();
        self.by_pair = vec![FREE; slots];
        self.by_id = vec![FREE; slots];
        for (number, definition) in self.definitions.iter().enumerate() {
            // At most MAX_DEFINITIONS.
            let number = number as u16;
            let pair = pair_hash(definition.id, definition.crc_extra);
            insert(&mut self.by_pair, pair, number, |_| false);
            let is_same = |other: u16| self.definitions[usize::from(other)].id == definition.id;
            insert(&mut self.by_id, id_hash(definition.id), number, is_same);
        }
    }
}

impl Default for Dialect {
    fn default() -> Self {
        Self::builtin()
    }
}

/// Puts `number` into the first free slot, unless an entry before it `is_same`.
fn insert(index: &mut [u16], hash: u32, number: u16, is_same: impl Fn(u16) -> bool) {
    let mask = index.len() - 1;
    let mut slot = hash as usize & mask;
    while index[slot] != FREE {
        if is_same(index[slot]) {
            return;
        }
        slot = (slot + 1) & mask;
    }
    index[slot] = number;
}

fn pair_hash(id: MessageId, crc_extra: u8) -> u32 {
    id_hash(MessageId(id.0 << 8 | u32::from(crc_extra)))
}

/// Fibonacci hashing: the upper half of a product with 2^32 divided by the golden ratio.
fn id_hash(id: MessageId) -> u32 {
    id.0.wrapping_mul(0x9e37_79b9) >> 16
}

/// No definition in this slot.
const FREE: u16 = u16::MAX;

/// A row of the built-in table; offsets below 0 stand for an absent field.
const fn row(
    id: u32,
    crc_extra: u8,
    name: &'static str,
    base_len: u16,
    max_len: u16,
    system: i16,
    component: i16,
) -> Definition {
    let target = match (system, component) {
        (-1, _) => Target::None,
        (system, -1) => Target::System(system as u8),
        (system, component) => Target::SystemComponent(system as u8, component as u8),
    };
    let (id, name) = (MessageId(id), Cow::Borrowed(name));
    Definition { id, crc_extra, name, base_len, max_len, target }
}

static BUILTIN: &[Definition] = include!(concat!(env!("OUT_DIR"), "/messages.rs"));

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_published_pair_is_in_the_table() {
        let dialect = Dialect::builtin();
        assert_eq!(dialect.definitions().len(), 765);
        for definition in dialect.definitions() {
            let found = dialect.by_pair(definition.id, definition.crc_extra);
            assert_eq!(found, Some(definition));
        }
        assert_eq!(dialect.by_pair(MessageId(0), 49), None);
        assert_eq!(dialect.by_id(MessageId(0xff_ffff)), None);
    }

    #[test]
    fn the_table_says_what_its_source_says() {
        for (line, built_in) in include_str!("messages.tsv").lines().skip(1).zip(BUILTIN) {
            let mut fields = line.split('\t');
            let mut number = || fields.next().unwrap().parse::<i32>();
            let (id, extra) = (number().unwrap() as u32, number().unwrap() as u8);
            let name = line.split('\t').nth(2).unwrap();
            let [base, max, system, component] =
                [3, 4, 5, 6].map(|at| line.split('\t').nth(at).unwrap().parse::<i16>().unwrap());
            let read = row(id, extra, name, base as u16, max as u16, system, component);
            assert_eq!(&read, built_in, "{line}");
        }
        assert_eq!(include_str!("messages.tsv").lines().count(), 1 + BUILTIN.len());
    }

    #[test]
    fn rule_25_an_id_alone_means_what_it_means_today() {
        let dialect = Dialect::builtin();
        let name = |id| dialect.by_id(MessageId(id)).map(|d| d.name.as_ref());
        assert_eq!(name(0), Some("HEARTBEAT"));
        assert_eq!(name(110), Some("FILE_TRANSFER_PROTOCOL"));
        assert_eq!(name(180), Some("CAMERA_FEEDBACK"));
    }

    #[test]
    fn a_definition_of_the_users_own_takes_the_place_of_the_built_in_one() {
        let mut dialect = Dialect::builtin();
        let mut heartbeat = dialect.by_id(MessageId::HEARTBEAT).unwrap().clone();
        heartbeat.target = Target::System(0);
        let mut own = heartbeat.clone();
        own.id = MessageId(54_321);
        dialect.add([heartbeat.clone(), own.clone()]).unwrap();
        assert_eq!(dialect.definitions().len(), 766);
        assert_eq!(dialect.by_pair(MessageId(0), 50), Some(&heartbeat));
        assert_eq!(dialect.by_id(MessageId(54_321)), Some(&own));
    }

    #[test]
    fn an_older_copy_of_a_definition_takes_no_target_away() {
        let mut dialect = Dialect::builtin();
        let timesync = dialect.by_id(MessageId(111)).unwrap().clone();
        let mut old = timesync.clone();
        (old.max_len, old.target) = (old.base_len, Target::None);
        dialect.add([old]).unwrap();
        assert_eq!(dialect.by_pair(MessageId(111), 34), Some(&timesync));
    }

    #[test]
    fn the_table_is_bounded() {
        let mut dialect = Dialect::builtin();
        let template = dialect.definitions()[0].clone();
        let many = (0..30_000).map(|id| Definition { id: MessageId(id), ..template.clone() });
        assert_eq!(dialect.add(many), Err(TooManyDefinitions));
        assert_eq!(dialect.definitions().len(), 765);
    }
}
