//! Counts of simultaneous users of a resource, in total and by address.

use std::collections::HashMap;
use std::net::{IpAddr, Ipv6Addr};
use std::sync::{Arc, Mutex, PoisonError};

/// Admits users of a resource up to a limit. One address may have at most half of it.
#[derive(Debug)]
pub(crate) struct Guests {
    most: usize,
    /// Whether loopback addresses may use the whole limit.
    at_home: bool,
    there: Mutex<There>,
}

#[derive(Debug, Default)]
struct There {
    all: usize,
    of: HashMap<IpAddr, usize>,
}

impl Guests {
    /// A limit of `most` users, at least two.
    pub(crate) fn new(most: usize) -> Arc<Self> {
        Arc::new(Self { most: most.max(2), at_home: false, there: Mutex::default() })
    }

    /// A limit of `most` users. A loopback address may use all of it, since it may be a proxy for
    /// many. Other addresses may use half, and at least eight.
    pub(crate) fn with_proxies(most: usize) -> Arc<Self> {
        Arc::new(Self { most, at_home: true, there: Mutex::default() })
    }

    fn most_of(&self, network: IpAddr) -> usize {
        match self.at_home {
            true if network.is_loopback() => self.most,
            true => (self.most / 2).max(8),
            false => self.most / 2,
        }
    }

    /// Admits one user from an address until the guest is dropped; `None` where there is no room.
    pub(crate) fn enter(self: &Arc<Self>, address: IpAddr) -> Option<Guest> {
        let network = network(address);
        let mut there = self.there();
        let of = there.of.get(&network).copied().unwrap_or(0);
        if there.all >= self.most || of >= self.most_of(network) {
            return None;
        }
        there.all += 1;
        there.of.insert(network, of + 1);
        Some(Guest { guests: self.clone(), network })
    }

    pub(crate) fn count(&self) -> usize {
        self.there().all
    }

    fn there(&self) -> std::sync::MutexGuard<'_, There> {
        self.there.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// An admitted user.
#[derive(Debug)]
pub(crate) struct Guest {
    guests: Arc<Guests>,
    network: IpAddr,
}

impl Drop for Guest {
    fn drop(&mut self) {
        let mut there = self.guests.there();
        there.all -= 1;
        let of = there.of.remove(&self.network).unwrap_or(1);
        if of > 1 {
            there.of.insert(self.network, of - 1);
        }
    }
}

/// The key by which addresses are counted: an IPv4 address, or an IPv6 network of 64 bits, since
/// one machine may hold all addresses of it.
fn network(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V6(ip) => {
            if ip.is_loopback() {
                return ip.into();
            }
            let [a, b, c, d, ..] = ip.segments();
            Ipv6Addr::new(a, b, c, d, 0, 0, 0, 0).into()
        }
        ip => ip,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ip(text: &str) -> IpAddr {
        text.parse().expect("an address")
    }

    #[test]
    fn no_address_takes_more_than_half() {
        let guests = Guests::new(4);
        let enter = |address: &str| guests.enter(ip(address));
        let (one, two) = (enter("10.0.0.1"), enter("10.0.0.1"));
        assert!(one.is_some() && two.is_some() && enter("10.0.0.1").is_none());
        assert!(enter("::ffff:10.0.0.1").is_none(), "the same address");
        let (three, four) = (enter("2001:db8::1"), enter("2001:db8::2"));
        assert!(three.is_some() && four.is_some() && enter("10.0.0.2").is_none(), "full");
        drop(one);
        assert!(enter("2001:db8::3").is_none(), "of the same network");
        assert!(enter("10.0.0.1").is_some());
        drop((two, three, four));
        assert_eq!(guests.count(), 0);
        assert!(guests.there().of.is_empty());
    }

    #[test]
    fn proxies_may_take_all() {
        let guests = Guests::with_proxies(20);
        let enter = |address: &str, times| -> Vec<_> {
            (0..times).map_while(|_| guests.enter(ip(address))).collect()
        };
        let stranger = enter("10.0.0.1", 30);
        assert_eq!(stranger.len(), 10);
        assert_eq!(enter("::1", 30).len(), 10, "what is left");
        drop(stranger);
        assert_eq!(enter("127.0.0.1", 30).len(), 20);
        let few = Guests::with_proxies(3);
        let all: Vec<_> = (0..5).map_while(|_| few.enter(ip("10.0.0.1"))).collect();
        assert_eq!(all.len(), 3);
    }
}
