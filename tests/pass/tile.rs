//! Which tiles each splat touches, the sorted lists of tiles and layers, and the occupied tiles of the layers.

use super::blend::opaque_scene;
use super::fixture::{Fixture, prove};
use crate::reference::Rules;
use crate::reference::scan::{compact, exclusive_scan};
use crate::reference::sort::radix_sort;
use crate::reference::tile::{TileGrid, counted_tiles, row_interval, tile_lengths, tile_ranges, tiles_within};
use crate::support::compare::{Summary, check, exact};
use crate::support::device;
use crate::support::scenes::{Shape, generator, scene, uniform};
use labelgs::pass::KernelShape;
use labelgs::scheduler::plan::Buf;
use labelgs::verify::selftest::order::DepthOrder;

/// Log2 units that the device may err on the side of one tile too many: 0.01, 2e-6 of the exponent's terms, and 0.001
/// px.
const SLACK: f64 = 0.02;

#[test]
fn tile_lists_equal_their_mirror() {
    for looks_back in [false, true] {
        let Some(turn) = device() else { return };
        let shape =
            KernelShape { sweep_items: 0, group_walks: looks_back, ..KernelShape::for_device(turn.capabilities()) };
        lists_equal_their_mirror(Fixture::with_shape(turn, opaque_scene(81), true, shape));
    }
}

fn lists_equal_their_mirror(mut fixture: Fixture) {
    let counters = fixture.train().counters;
    let order = DepthOrder::read(&mut fixture).expect("an order");
    let (splats, pairs) = (fixture.splats(), counters.instance_count as usize);
    let (uniforms, shape, labels) = (fixture.uniforms(), *fixture.engine.shape(), fixture.model().labels);
    let grid = TileGrid { size: fixture.size(), tile: (shape.tile_width as usize, shape.tile_height as usize) };
    let touched = order.sorted(&fixture.get::<u32>(Buf::TILES_TOUCHED, splats.len()));
    let (offsets, total) = exclusive_scan(&touched);
    let found = order.sorted(&fixture.get::<u32>(Buf::INSTANCE_OFFSETS, splats.len()));
    check("instance_offsets", exact(&found, &offsets));
    assert_eq!(counters.instance_count, total);

    let (sorted_keys, slots) = fixture.sorted_pairs(pairs);
    let mut keys = vec![u32::MAX; pairs];
    slots.iter().zip(&sorted_keys).for_each(|(&slot, &key)| keys[slot as usize] = key);
    check("order of pairs", exact(&slots, &radix_sort(&keys).iter().map(|&slot| slot as u32).collect::<Vec<_>>()));
    let splat_from_instance = fixture.get::<u32>(Buf::SPLAT_FROM_INSTANCE, pairs);
    let owners = touched.iter().zip(&order.splats).flat_map(|(&n, &splat)| std::iter::repeat_n(splat, n as usize));
    check("splat_from_instance", exact(&splat_from_instance, &owners.collect::<Vec<_>>()));

    let layers = fixture.input.layers.clone();
    let layer_of = |gaussian: usize| layers.iter().position(|&label| u32::from(label) == labels[gaussian]);
    assert!(splats.iter().any(|s| layer_of(s.gaussian).is_some()) && splats.iter().any(|s| labels[s.gaussian] == 0));
    prove("tiles of splats", &["alpha_min"], |rules| {
        for (index, splat) in splats.iter().enumerate() {
            let all = &keys[offsets[index] as usize..][..touched[index] as usize];
            let layer = layer_of(splat.gaussian);
            let tiles = &all[..if layer.is_some() { all.len() / 2 } else { all.len() }];
            if let Some(layer) = layer {
                let moved = tiles.iter().map(|tile| (layer as u32 + 1) * uniforms.tile_count + tile);
                exact(&all[tiles.len()..], &moved.collect::<Vec<_>>())?;
            }
            let (least, most) = (counted_tiles(rules, splat, &grid), tiles_within(rules, splat, &grid, SLACK));
            if !tiles.is_sorted() || !least.iter().all(|t| tiles.contains(t)) || !tiles.iter().all(|t| most.contains(t))
            {
                return Err(format!(
                    "splat {index}: tiles {tiles:?}, at least {least:?}, at most {most:?} are expected"
                ));
            }
        }
        Ok(Summary::default())
    });
    lists(&mut fixture, &sorted_keys, &slots, &splat_from_instance, &order);
}

/// Keys of 16 bits number 65,536 tiles of all layers; more have wide ones, and narrow ones again without the layers.
#[test]
fn lists_of_narrow_keys_equal_their_mirror_up_to_the_last_tile() {
    for (layers, narrow) in [(63, true), (64, false)] {
        let Some(turn) = device().filter(|turn| turn.capabilities().has_narrow_storage()) else { return };
        let own = KernelShape { narrow_keys: true, ..KernelShape::for_device(turn.capabilities()) }.with_sweeps_of(4);
        let (width, height) = (32 * own.tile_width, 32 * own.tile_height);
        let size = Shape {
            gaussians: 40,
            scales: (0.01, 0.05),
            width,
            height,
            objects: layers,
            sh_degree: 0,
            ..Shape::default()
        };
        let mut scene = scene(84, &size);
        // In every tile of the last layer.
        scene.gaussians.scales[0] = [1.5; 3];
        scene.gaussians.labels.as_mut().expect("labels")[0] = layers;
        let mut fixture = Fixture::with_shape(turn, scene, true, own);
        let pairs = fixture.train().counters.instance_count as usize;
        let tiles = fixture.engine.capacity().virtual_tiles;
        assert_eq!((tiles, own.has_narrow_keys(tiles)), (1024 * (u64::from(layers) + 1), narrow));
        let (keys, slots) = fixture.sorted_pairs(pairs);
        assert_eq!(keys.last().map(|&key| u64::from(key)), Some(tiles - 1));
        let owners = fixture.get::<u32>(Buf::SPLAT_FROM_INSTANCE, pairs);
        let order = DepthOrder::read(&mut fixture).expect("an order");
        lists(&mut fixture, &keys, &slots, &owners, &order);
        let splats = fixture.sorted_splats(pairs);
        let of_scene = keys.iter().zip(&splats).filter(|(key, _)| **key < 1024);
        let (keys, splats): (Vec<u32>, Vec<u32>) = of_scene.map(|(key, splat)| (*key, *splat)).unzip();
        assert_eq!(fixture.render().counters.instance_count as usize, keys.len());
        check("keys of the scene", exact(&fixture.sorted_pairs(keys.len()).0, &keys));
        check("splats of the scene", exact(&fixture.sorted_splats(keys.len()), &splats));
        let starts: Vec<u32> = tile_ranges(&keys, 1024).iter().map(|range| range[0]).collect();
        check("tile_starts", exact(&fixture.get::<u32>(Buf::TILE_STARTS, 1024), &starts));
    }
}

fn lists(fixture: &mut Fixture, sorted_keys: &[u32], slots: &[u32], splat_from_instance: &[u32], order: &DepthOrder) {
    let (uniforms, counters) = (fixture.uniforms(), fixture.engine.report(0).expect("a report").counters);
    let virtual_tiles = (uniforms.tile_count * (uniforms.layer_count + 1)) as usize;
    let ranges = tile_ranges(sorted_keys, virtual_tiles);
    let starts: Vec<u32> = ranges.iter().map(|range| range[0]).collect();
    let ends: Vec<u32> = ranges.iter().map(|range| range[1]).collect();
    check("tile_starts", exact(&fixture.get::<u32>(Buf::TILE_STARTS, virtual_tiles), &starts));
    check("tile_ends", exact(&fixture.get::<u32>(Buf::TILE_ENDS, virtual_tiles), &ends));
    let ranks = order.ranks();
    let rank = |&slot: &u32| ranks[splat_from_instance[slot as usize] as usize];
    let sorted: Vec<u32> = slots.iter().map(rank).collect();
    assert!(ranges.iter().all(|&[a, b]| sorted[a as usize..b as usize].is_sorted()), "lists run front to back");

    let (longest, occupied) = tile_lengths(&ranges);
    assert_eq!(counters.longest_list, longest);
    let first = uniforms.tile_count as usize;
    let flags: Vec<u32> = (0..virtual_tiles).map(|tile| u32::from(tile >= first && occupied[tile])).collect();
    check("layer_occupied", exact(&fixture.get::<u32>(Buf::LAYER_OCCUPIED, virtual_tiles), &flags));
    let listed = compact(&flags);
    assert_eq!(counters.layer_tile_count as usize, listed.len());
    check("layer_tiles", exact(&fixture.get::<u32>(Buf::LAYER_TILES, listed.len()), &listed));
}

/// Round splats, needles in all directions, huge ones, and centres far outside: in every tile where a pixel counts, in
/// no tile beyond the rounding, and in each row in neighbours.
#[test]
fn tiles_of_needles_and_giants_equal_their_mirror() {
    let Some(turn) = device() else { return };
    let mut scene = scene(82, &Shape { gaussians: 600, width: 61, height: 45, sh_degree: 0, ..Shape::default() });
    let mut random = generator(83);
    for (index, mean) in scene.gaussians.means.iter_mut().enumerate() {
        let far = if index % 2 == 0 { 1.0 } else { 5.0 };
        *mean = mean.map(|value| value * far);
        scene.gaussians.scales[index] = [0; 3].map(|_| uniform(&mut random, -8.0, 6.0) as f32);
    }
    let mut fixture = Fixture::new(turn, scene, false);
    let pairs = fixture.train().counters.instance_count as usize;
    let (splats, shape) = (fixture.splats(), *fixture.engine.shape());
    let grid = TileGrid { size: fixture.size(), tile: (shape.tile_width as usize, shape.tile_height as usize) };
    let (keys, owners) = (fixture.sorted_pairs(pairs).0, fixture.sorted_splats(pairs));
    let mut found = vec![Vec::new(); splats.len()];
    keys.iter().zip(&owners).for_each(|(&key, &owner)| found[owner as usize].push(key as usize));
    let (mut listed, mut beyond) = (0, 0);
    for (splat, tiles) in splats.iter().zip(&found) {
        // Roundings of the terms of the exponent are larger than the cut for such a needle; 0.001 px at a steep border
        // besides.
        let (width, height) = grid.size;
        let far = [(splat.mean2d[0], width as f64), (splat.mean2d[1], height as f64)]
            .map(|(m, size)| m.abs().max((size - m).abs()));
        let [a, b, c] = splat.conic;
        let terms = a * far[0] * far[0] + 2.0 * b.abs() * far[0] * far[1] + c * far[1] * far[1];
        let rules = Rules::default();
        let (least, most) =
            (counted_tiles(&rules, splat, &grid), tiles_within(&rules, splat, &grid, 0.03 + 3e-6 * terms));
        assert!(least.iter().all(|&tile| tiles.contains(&(tile as usize))), "{splat:?}: {tiles:?}, at least {least:?}");
        assert!(tiles.iter().all(|&tile| most.contains(&(tile as u32))), "{splat:?}: {tiles:?}, at most {most:?}");
        for row in tiles.chunk_by(|a, b| a / grid.columns() == b / grid.columns()) {
            assert!(row.windows(2).all(|two| two[1] == two[0] + 1), "{splat:?}: {row:?}");
        }
        let closed =
            (0..grid.rows()).map(|row| row_interval(&rules, splat, &grid, row)).map(|(start, end)| end - start);
        listed += tiles.len();
        beyond += tiles.len().abs_diff(closed.sum());
    }
    println!("{beyond} of {listed} tiles within rounding");
    assert!(
        splats.len() > 150 && listed > 2000 && beyond * 100 < listed,
        "{} splats, {beyond} of {listed} tiles",
        splats.len()
    );
}
