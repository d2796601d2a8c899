//! Which endpoint of a new configuration is which of those that are there: by name and address.

use std::collections::HashMap;
use std::hash::Hash;

use super::endpoint_table::{EndpointId, EndpointTable};
use super::settings::Settings;
use crate::config::{AddressKind, EndpointConfig};

/// What becomes of the endpoints.
#[derive(Default, Debug)]
pub(super) struct Plan {
    /// They go, because they are not wanted any more or because they have to be opened again.
    pub(super) gone: Vec<EndpointId>,
    /// They stay open, with these settings.
    pub(super) kept: Vec<(EndpointId, Settings)>,
    /// They come; some of them in place of one that goes.
    pub(super) new: Vec<(Settings, Option<EndpointId>)>,
}

/// Says what becomes of the endpoints in `table` if these are wanted instead.
///
/// One that is wanted as it is stays. Then one of the same name stays if it can become what is
/// wanted while it is open; then one of another name that can, which was given a new name; and at
/// last, one of the same name is closed and opened again. So is a server at `[::]` that is to leave
/// IPv4 to another one from now on, or not to any more.
pub(super) fn plan(table: &EndpointTable, wanted: Vec<Settings>) -> Plan {
    let mut ids = table.ids();
    // What belongs to the program itself is no matter of a configuration, which cannot name it.
    ids.retain(|id| !is_internal(&table[*id].config));
    let mut matching = Matching {
        old: ids.iter().map(|id| &table[*id].config).collect(),
        new: wanted.iter().map(|settings| &settings.config).collect(),
        is_taken: vec![false; ids.len()],
        found: vec![None; wanted.len()],
    };
    matching.pair(ToString::to_string, EndpointConfig::eq);
    matching.pair(EndpointConfig::name, EndpointConfig::can_become);
    matching.pair(EndpointConfig::fixed, |_, _| true);
    let mut stays = matching.is_taken.clone();
    let mut kept: Vec<bool> = matching.found.iter().map(Option::is_some).collect();
    for (new, old) in matching.with_another_share() {
        (kept[new], stays[old]) = (false, false);
    }
    matching.pair(EndpointConfig::name, |_, _| true);
    let found = matching.found;

    let gone = ids.iter().zip(stays).filter(|(_, stays)| !stays).map(|(id, _)| *id);
    let mut plan = Plan { gone: gone.collect(), ..Plan::default() };
    for ((settings, found), is_kept) in wanted.into_iter().zip(found).zip(kept) {
        match found.map(|old| ids[old]) {
            Some(id) if is_kept => plan.kept.push((id, settings)),
            predecessor => plan.new.push((settings, predecessor)),
        }
    }
    plan
}

/// Whether it belongs to the program itself.
pub(super) fn is_internal(config: &EndpointConfig) -> bool {
    config.address.kind() == AddressKind::Internal
}

struct Matching<'a> {
    old: Vec<&'a EndpointConfig>,
    new: Vec<&'a EndpointConfig>,
    /// Of `old`: whether it has been found for one of `new`.
    is_taken: Vec<bool>,
    /// Of `new`: which of `old` it is.
    found: Vec<Option<usize>>,
}

impl Matching<'_> {
    /// Finds for each new one that has none yet the first old one with the same key that fits.
    fn pair<K: Hash + Eq>(
        &mut self,
        key: impl Fn(&EndpointConfig) -> K,
        fits: impl Fn(&EndpointConfig, &EndpointConfig) -> bool,
    ) {
        let mut by_key: HashMap<K, Vec<usize>> = HashMap::new();
        let left = (0..self.old.len()).filter(|at| !self.is_taken[*at]);
        left.for_each(|at| by_key.entry(key(self.old[at])).or_default().push(at));
        for (new, found) in self.new.iter().zip(&mut self.found) {
            if found.is_none()
                && let Some(candidates) = by_key.get_mut(&key(new))
                && let Some(at) = candidates.iter().position(|old| fits(self.old[*old], new))
            {
                let old = candidates.remove(at);
                self.is_taken[old] = true;
                *found = Some(old);
            }
        }
    }

    /// The pairs, new and old, of which only one leaves IPv4 to another endpoint.
    fn with_another_share(&self) -> Vec<(usize, usize)> {
        let leaves_ipv4 =
            |at: usize, all: &[&EndpointConfig]| all[at].leaves_ipv4_to(all.iter().copied());
        let found = self.found.iter().enumerate();
        let pairs = found.filter_map(|(new, found)| Some((new, (*found)?)));
        let differs = |(new, old): &(usize, usize)| {
            leaves_ipv4(*new, &self.new) != leaves_ipv4(*old, &self.old)
        };
        pairs.filter(differs).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::daemon::endpoint::Endpoint;
    use crate::daemon::settings::settle;
    use crate::mavlink::Dialect;
    use crate::routing::Time;

    fn settled(texts: &[&str]) -> Vec<Settings> {
        let configs = texts.iter().map(|text| text.parse().unwrap()).collect();
        settle(configs, &Dialect::builtin()).unwrap()
    }

    /// What becomes of `old`, in words: the numbers are those of the old ones.
    fn told(old: &[&str], new: &[&str]) -> Vec<String> {
        let mut table = EndpointTable::default();
        for settings in settled(old) {
            table.insert(Endpoint::new(settings, Time::ZERO)).unwrap();
        }
        let plan = plan(&table, settled(new));
        let gone = plan.gone.iter().map(|id| format!("{} goes", id.slot()));
        let kept = plan.kept.iter().map(|(id, settings)| {
            let verb = if table[*id].config == settings.config { "stays" } else { "becomes" };
            format!("{} {verb} {}", id.slot(), settings.config)
        });
        let new = plan.new.iter().map(|(settings, before)| match before {
            Some(id) => format!("{} comes for {}", settings.config, id.slot()),
            None => format!("{} comes", settings.config),
        });
        gone.chain(kept).chain(new).collect()
    }

    #[test]
    fn what_is_wanted_as_it_is_stays_wherever_it_stands() {
        let (a, b) = ("udpin:0.0.0.0:1?name=a", "udpin:0.0.0.0:2");
        assert_eq!(told(&[a, b], &[b, a]), [format!("1 stays {b}"), format!("0 stays {a}")]);
        assert_eq!(told(&[a, b], &[b]), ["0 goes".to_owned(), format!("1 stays {b}")]);
        assert_eq!(told(&[b], &[b, a]), [format!("0 stays {b}"), format!("{a} comes")]);
    }

    #[test]
    fn what_can_change_under_its_links_stays_open() {
        let new = "udpin:0.0.0.0:1?name=a&max_peers=3";
        assert_eq!(told(&["udpin::1?name=a"], &[new]), [format!("0 becomes {new}")]);
        let new = "sim:?name=a";
        assert_eq!(told(&["sim:"], &[new]), [format!("0 becomes {new}")]);
        let new = "serial:/dev/ttyS1:115200";
        assert_eq!(told(&["serial:/dev/ttyS1:57600"], &[new]), [format!("0 becomes {new}")]);
    }

    #[test]
    fn what_cannot_is_opened_again_under_its_name() {
        let (old, new) = ("udpin::1?name=a", "udpin:0.0.0.0:2?name=a");
        assert_eq!(told(&[old], &[new]), ["0 goes".to_owned(), format!("{new} comes for 0")]);
        // Vehicles are made with their rate.
        let (old, new) = ("sim:?name=a", "sim:?name=a&rate=10");
        assert_eq!(told(&[old], &[new]), ["0 goes".to_owned(), format!("{new} comes for 0")]);
        let (old, new) = ("udpout:x?bind=:1", "udpout:x:14550?bind=0.0.0.0:2");
        assert_eq!(told(&[old], &[new]), ["0 goes".to_owned(), format!("{new} comes for 0")]);
    }

    #[test]
    fn a_name_can_be_given_taken_and_changed() {
        let (named, renamed) = ("udpin:0.0.0.0:1?name=a", "udpin:0.0.0.0:1?name=b");
        let bare = "udpin:0.0.0.0:1";
        for (old, new) in [(bare, named), (named, renamed), (renamed, bare)] {
            assert_eq!(told(&[old], &[new]), [format!("0 becomes {new}")]);
        }
    }

    #[test]
    fn two_that_change_names_keep_their_links() {
        let old = ["udpin::1?name=a", "udpin::2?name=b"];
        let new = ["udpin:0.0.0.0:2?name=a", "udpin:0.0.0.0:1?name=b"];
        let expected = [format!("1 becomes {}", new[0]), format!("0 becomes {}", new[1])];
        assert_eq!(told(&old, &new), expected);
    }

    #[test]
    fn a_server_for_both_is_opened_again_when_one_for_ipv4_comes_or_goes() {
        let (both, ipv4) = ("tcpin:[::]:1?name=a", "tcpin:0.0.0.0:1?name=b");
        let again = |number| [format!("{number} goes"), format!("{both} comes for {number}")];
        let comes = [&again(0)[..], &[format!("{ipv4} comes")]].concat();
        assert_eq!(told(&[both], &[both, ipv4]), comes);
        assert_eq!(told(&[ipv4, both], &[both])[1..], again(1));
        let others = ["tcpin:0.0.0.0:2", "udpin:0.0.0.0:1"];
        assert_eq!(told(&[both], &[both, others[0], others[1]])[0], format!("0 stays {both}"));
    }

    #[test]
    fn of_two_at_one_place_the_one_that_is_wanted_stays() {
        let old = ["udpout:x:1?bind=0.0.0.0:1", "udpout:x:1?bind=0.0.0.0:2"];
        assert_eq!(told(&old, &old[1..]), ["0 goes".to_owned(), format!("1 stays {}", old[1])]);
        assert_eq!(told(&old[..1], &[old[0]; 2])[1], format!("{} comes", old[0]));
    }
}
