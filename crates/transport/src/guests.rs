//! How many of something are there at once, in all and from one address.

use std::collections::HashMap;
use std::net::{IpAddr, Ipv6Addr};
use std::sync::{Arc, Mutex, PoisonError};

/// Counts those who are there, and lets in no more than there is room for: no address has more than a
/// half of it.
#[derive(Debug)]
pub(crate) struct Guests {
    most: usize,
    there: Mutex<There>,
}

#[derive(Debug, Default)]
struct There {
    all: usize,
    of: HashMap<IpAddr, usize>,
}

impl Guests {
    /// Room for so many, at least two.
    pub(crate) fn new(most: usize) -> Arc<Self> {
        Arc::new(Self { most: most.max(2), there: Mutex::default() })
    }

    /// One more from an address, until it is dropped; `None` where there is no room.
    pub(crate) fn enter(self: &Arc<Self>, address: IpAddr) -> Option<Guest> {
        let network = network(address);
        let mut there = self.there();
        let of = there.of.get(&network).copied().unwrap_or(0);
        if there.all >= self.most || of >= self.most / 2 {
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

/// One of those who are there.
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

/// What counts as one address: of IPv6 the network, of which one machine holds all addresses.
fn network(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V6(ip) => {
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
}
