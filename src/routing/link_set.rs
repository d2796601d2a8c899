//! Links by number, and sets of them as bits, so that "all but the sender" is one expression.

use std::fmt;
use std::ops::{BitAnd, BitOr, Sub};

/// How many links there may be at one time.
pub const MAX_LINKS: usize = 1_024;

const WORDS: usize = MAX_LINKS / 64;

/// A link's number, printed `#3`. It is given again once the link is gone.
///
/// Invariant: below [`MAX_LINKS`].
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct LinkId(u16);

impl LinkId {
    /// The link with this number, if there may be one.
    pub const fn new(number: usize) -> Option<Self> {
        if number < MAX_LINKS { Some(Self(number as u16)) } else { None }
    }

    /// The lowest number.
    pub(super) const ZERO: Self = Self(0);

    /// The number, for tables.
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

impl fmt::Display for LinkId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "#{}", self.0)
    }
}

/// A set of links.
#[derive(Clone, Copy, PartialEq, Eq, Default)]
pub struct LinkSet([u64; WORDS]);

impl LinkSet {
    /// No link.
    pub const EMPTY: Self = Self([0; WORDS]);

    /// Just this link.
    pub fn of(link: LinkId) -> Self {
        let mut set = Self::EMPTY;
        set.insert(link);
        set
    }

    /// Adds a link.
    #[inline]
    pub fn insert(&mut self, link: LinkId) {
        self.0[link.index() / 64] |= 1 << (link.index() % 64);
    }

    /// Takes a link out.
    #[inline]
    pub fn remove(&mut self, link: LinkId) {
        self.0[link.index() / 64] &= !(1 << (link.index() % 64));
    }

    /// Whether the link is in.
    #[inline]
    pub fn contains(&self, link: LinkId) -> bool {
        self.0[link.index() / 64] & (1 << (link.index() % 64)) != 0
    }

    /// Whether no link is in.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.0.iter().fold(0, |all, word| all | word) == 0
    }

    /// How many links are in.
    pub fn len(&self) -> usize {
        self.0.iter().map(|word| word.count_ones() as usize).sum()
    }

    /// The lowest number that is not in.
    pub fn first_absent(&self) -> Option<LinkId> {
        let word = self.0.iter().position(|word| *word != u64::MAX)?;
        LinkId::new(word * 64 + self.0[word].trailing_ones() as usize)
    }

    /// The links, lowest number first.
    #[inline]
    pub fn iter(&self) -> Links<'_> {
        Links { set: self, next_word: 0, word: 0 }
    }

    fn zip(self, other: Self, combine: impl Fn(u64, u64) -> u64) -> Self {
        let mut words = self.0;
        for (word, other) in words.iter_mut().zip(other.0) {
            *word = combine(*word, other);
        }
        Self(words)
    }
}

/// Walks over a set.
#[derive(Clone, Debug)]
pub struct Links<'a> {
    set: &'a LinkSet,
    next_word: usize,
    /// What is left of the word before the next one.
    word: u64,
}

impl Iterator for Links<'_> {
    type Item = LinkId;

    #[inline]
    fn next(&mut self) -> Option<LinkId> {
        while self.word == 0 {
            self.word = *self.set.0.get(self.next_word)?;
            self.next_word += 1;
        }
        let bit = self.word.trailing_zeros() as usize;
        self.word &= self.word - 1;
        Some(LinkId(((self.next_word - 1) * 64 + bit) as u16))
    }
}

impl BitOr for LinkSet {
    type Output = Self;

    fn bitor(self, other: Self) -> Self {
        self.zip(other, |a, b| a | b)
    }
}

impl BitAnd for LinkSet {
    type Output = Self;

    fn bitand(self, other: Self) -> Self {
        self.zip(other, |a, b| a & b)
    }
}

impl Sub for LinkSet {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a & !b)
    }
}

impl Extend<LinkId> for LinkSet {
    #[inline]
    fn extend<I: IntoIterator<Item = LinkId>>(&mut self, links: I) {
        links.into_iter().for_each(|link| self.insert(link));
    }
}

impl FromIterator<LinkId> for LinkSet {
    #[inline]
    fn from_iter<I: IntoIterator<Item = LinkId>>(links: I) -> Self {
        let mut set = Self::EMPTY;
        set.extend(links);
        set
    }
}

impl fmt::Debug for LinkSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_set().entries(self.iter()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(numbers: &[usize]) -> LinkSet {
        numbers.iter().filter_map(|number| LinkId::new(*number)).collect()
    }

    #[test]
    fn all_but_the_sender_and_its_group_is_one_expression() {
        let all = set(&[0, 1, 63, 64, 1_023]);
        let group = set(&[63, 64]);
        let rest = all - LinkSet::of(LinkId(1)) - group;
        let numbers: Vec<usize> = rest.iter().map(LinkId::index).collect();
        assert_eq!(numbers, [0, 1_023]);
        assert_eq!(rest.len(), 2);
    }

    #[test]
    fn the_lowest_free_number_is_found() {
        let mut all: LinkSet = (0..MAX_LINKS).filter_map(LinkId::new).collect();
        assert_eq!(all.first_absent(), None);
        all.remove(LinkId(700));
        assert_eq!(all.first_absent(), Some(LinkId(700)));
        assert_eq!(LinkSet::EMPTY.first_absent(), Some(LinkId(0)));
        assert_eq!(LinkId::new(MAX_LINKS), None);
    }
}
