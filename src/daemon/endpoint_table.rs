//! All endpoints, each under an id that nobody else ever has: who still holds the id of one that is
//! gone finds nothing, also when another has taken its place.

use std::collections::HashSet;
use std::ops::{Index, IndexMut};

use super::endpoint::Endpoint;
use crate::config::MAX_ENDPOINTS;

/// An endpoint, as long as it is there.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub(super) struct EndpointId {
    /// Its place in the table.
    slot: u16,
    /// How many had this place before.
    generation: u32,
}

impl EndpointId {
    /// Its place in the table: that of no other endpoint as long as it is there.
    pub(super) fn slot(self) -> u16 {
        self.slot
    }
}

/// The endpoints.
#[derive(Default, Debug)]
pub(super) struct EndpointTable(Vec<Slot>);

#[derive(Default, Debug)]
struct Slot {
    generation: u32,
    endpoint: Option<Endpoint>,
}

impl EndpointTable {
    /// Adds an endpoint; `None` if there are [`MAX_ENDPOINTS`] already.
    ///
    /// It gets a name that no other one has.
    pub(super) fn insert(&mut self, mut endpoint: Endpoint) -> Option<EndpointId> {
        let free = self.0.iter().position(|slot| slot.endpoint.is_none());
        let place = free.unwrap_or(self.0.len());
        if place >= MAX_ENDPOINTS {
            return None;
        }
        if free.is_none() {
            self.0.push(Slot::default());
        }
        let others: HashSet<&str> = self.iter().map(|other| other.name.as_str()).collect();
        endpoint.name = free_name(endpoint.name, |name| others.contains(name));
        let slot = &mut self.0[place];
        slot.endpoint = Some(endpoint);
        Some(EndpointId { slot: u16::try_from(place).ok()?, generation: slot.generation })
    }

    /// Takes an endpoint out. Its links must be gone.
    pub(super) fn remove(&mut self, id: EndpointId) -> Option<Endpoint> {
        let slot = self.0.get_mut(usize::from(id.slot))?;
        if slot.generation != id.generation {
            return None;
        }
        slot.generation = slot.generation.wrapping_add(1);
        slot.endpoint.take()
    }

    /// The endpoint, unless it is gone.
    pub(super) fn get(&self, id: EndpointId) -> Option<&Endpoint> {
        let slot = self.0.get(usize::from(id.slot))?;
        slot.endpoint.as_ref().filter(|_| slot.generation == id.generation)
    }

    /// The same, to be changed.
    pub(super) fn get_mut(&mut self, id: EndpointId) -> Option<&mut Endpoint> {
        let slot = self.0.get_mut(usize::from(id.slot))?;
        slot.endpoint.as_mut().filter(|_| slot.generation == id.generation)
    }

    /// Who is at this place now.
    pub(super) fn id_at(&self, slot: u16) -> Option<EndpointId> {
        let found = self.0.get(usize::from(slot))?;
        found.endpoint.as_ref().map(|_| EndpointId { slot, generation: found.generation })
    }

    /// All ids, in the order of their places.
    pub(super) fn ids(&self) -> Vec<EndpointId> {
        // A place is below MAX_ENDPOINTS.
        (0..self.0.len()).filter_map(|slot| self.id_at(slot as u16)).collect()
    }

    /// After some have got other names: gives those who share one a name of their own.
    pub(super) fn tell_names_apart(&mut self) {
        let mut taken: HashSet<String> = HashSet::new();
        for endpoint in self.0.iter_mut().filter_map(|slot| slot.endpoint.as_mut()) {
            let name = std::mem::take(&mut endpoint.name);
            endpoint.name = free_name(name, |name| taken.contains(name));
            taken.insert(endpoint.name.clone());
        }
    }

    /// All endpoints, in the order of their places.
    pub(super) fn iter(&self) -> impl Iterator<Item = &Endpoint> {
        self.0.iter().filter_map(|slot| slot.endpoint.as_ref())
    }
}

/// `name`, or `name#2` and so on if that is taken.
fn free_name(name: String, is_taken: impl Fn(&str) -> bool) -> String {
    if !is_taken(&name) {
        return name;
    }
    // One more than there may be endpoints: one of them is free.
    let mut numbered = (2..=MAX_ENDPOINTS + 1).map(|number| format!("{name}#{number}"));
    numbered.find(|name| !is_taken(name)).unwrap_or(name)
}

/// For who knows that the endpoint is there: one of its links is, or it was just looked up.
///
/// # Panics
///
/// If it is gone.
impl Index<EndpointId> for EndpointTable {
    type Output = Endpoint;

    fn index(&self, id: EndpointId) -> &Endpoint {
        self.get(id).expect("an endpoint goes after its links and timers")
    }
}

impl IndexMut<EndpointId> for EndpointTable {
    fn index_mut(&mut self, id: EndpointId) -> &mut Endpoint {
        self.get_mut(id).expect("an endpoint goes after its links and timers")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::daemon::settings::settle;
    use crate::mavlink::Dialect;
    use crate::routing::Time;

    fn endpoint(text: &str) -> Endpoint {
        let settled = settle(vec![text.parse().unwrap()], &Dialect::builtin());
        Endpoint::new(settled.unwrap().remove(0), Time::ZERO)
    }

    #[test]
    fn the_id_of_one_that_is_gone_finds_nobody_in_its_place() {
        let mut table = EndpointTable::default();
        let first = table.insert(endpoint("udpin::1?name=first")).unwrap();
        let second = table.insert(endpoint("udpin::2?name=second")).unwrap();
        assert_eq!(table.remove(first).map(|gone| gone.name), Some("first".to_owned()));
        assert!(table.get(first).is_none() && table.id_at(0).is_none());
        let third = table.insert(endpoint("udpin::3?name=third")).unwrap();
        assert_eq!((third.slot(), table.id_at(0)), (first.slot(), Some(third)));
        assert!(table.get(first).is_none() && table.remove(first).is_none());
        assert_eq!(table.ids(), [third, second]);
        assert_eq!(table[third].name, "third");
    }

    #[test]
    fn no_two_endpoints_have_one_name() {
        let mut table = EndpointTable::default();
        let names = |table: &EndpointTable| -> Vec<String> {
            table.iter().map(|endpoint| endpoint.name.clone()).collect()
        };
        for text in ["udpin::1?dev=a", "udpin::1?dev=b", "udpin::2?name=fc"] {
            table.insert(endpoint(text)).unwrap();
        }
        let first = "udpin:0.0.0.0:1";
        assert_eq!(names(&table), [first.to_owned(), format!("{first}#2"), "fc".to_owned()]);
        let ids = table.ids();
        table[ids[2]].name = first.to_owned();
        table.tell_names_apart();
        assert_eq!(names(&table)[2], format!("{first}#3"));
        // It keeps its name for as long as it is there.
        table.remove(ids[0]);
        table.tell_names_apart();
        assert_eq!(names(&table), [format!("{first}#2"), format!("{first}#3")]);
    }

    #[test]
    fn there_is_an_end_to_endpoints() {
        let mut table = EndpointTable::default();
        let many = vec!["udpin::1".parse().unwrap(); MAX_ENDPOINTS];
        for settings in settle(many, &Dialect::builtin()).unwrap() {
            assert!(table.insert(Endpoint::new(settings, Time::ZERO)).is_some());
        }
        assert!(table.insert(endpoint("udpin::1")).is_none());
        let first = table.ids()[0];
        table.remove(first);
        assert!(table.insert(endpoint("udpin::1")).is_some());
    }
}
