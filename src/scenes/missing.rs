//! Listed photos without a file: a few are skipped; many mean that the photos are elsewhere.

use super::LoadOptions;
use super::bad_photos::allowed;
use super::listing::{ListedPhoto, Listing};
use labelgs_files::names::shortened;
use labelgs_scene::{Error, Result, Setting};

/// One of this many photos may be missing: published scenes list photos that they do not contain.
const MISSING_ONE_OF: usize = 3;

/// Returns the views whose photos exist. If photos are not requested and none exists, returns all views with a known
/// size. Notes skipped photos in `faults`.
pub(super) fn existing(
    listing: &Listing,
    options: &LoadOptions,
    notes: &mut Vec<String>,
    faults: &mut Vec<String>,
) -> Result<Vec<ListedPhoto>> {
    let total = listing.views.len() + listing.missing.len();
    if total + listing.bad.len() == 0 {
        let why = notes.iter().map(|note| format!("; {note}")).collect::<String>();
        return Err(Error::data(
            &listing.source,
            "",
            format!("lists no photo with a pose; align the photos first{why}"),
        ));
    }
    let found: Vec<ListedPhoto> = listing.views.iter().filter(|view| view.photo.is_some()).cloned().collect();
    if found.is_empty() && !options.photos && !listing.views.is_empty() {
        notes.push("no listed photo exists; cameras have the sizes stated in the data set".into());
        return Ok(listing.views.clone());
    }
    let absent = listing.views.iter().filter(|view| view.photo.is_none()).map(|view| view.name.as_str());
    let absent: Vec<&str> = absent.chain(listing.missing.iter().map(String::as_str)).collect();
    if absent.is_empty() {
        return one_file_each(listing, found);
    }
    tracing::debug!("photos that do not exist: {}", absent.join(", "));
    let missing = format!("{} of {total} listed photos do not exist ({})", absent.len(), shortened(&absent));
    // Callers who only request cameras can do without photos.
    let usual = if options.photos { total / MISSING_ONE_OF } else { total / 2 };
    let allowed = allowed(options.max_bad_photos, total).max(usual);
    if absent.len() > allowed {
        let limit = if found.is_empty() {
            String::new()
        } else {
            format!("; up to {allowed} may be missing: restore them, or allow more with {}", Setting("max_bad_photos"))
        };
        return Err(Error::data(&listing.source, "photos", format!("{missing}; {}{limit}", listing.hint)));
    }
    faults.push(format!("{missing} and are skipped; {}", listing.hint));
    one_file_each(listing, found)
}

/// Refuses two listed photos that were found in the same file.
fn one_file_each(listing: &Listing, found: Vec<ListedPhoto>) -> Result<Vec<ListedPhoto>> {
    let mut files: Vec<&ListedPhoto> = found.iter().collect();
    files.sort_by(|a, b| a.photo.cmp(&b.photo));
    if let Some([a, b]) = files.windows(2).find(|pair| pair[0].photo == pair[1].photo) {
        let file = a.photo.as_deref().unwrap_or(std::path::Path::new("")).display();
        let problem = format!(
            "is the only file for {} and {}; name the folder of the photos with {}",
            a.name,
            b.name,
            Setting("images")
        );
        return Err(Error::data(&listing.source, format!("{file}"), problem));
    }
    Ok(found)
}
