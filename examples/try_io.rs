use labelgs::io::{self, LoadOptions};
use std::time::Instant;
fn main() {
    let mut args = std::env::args().skip(1);
    let scene = args.next().unwrap();
    let mut o = LoadOptions::default();
    let mut dump = None;
    while let Some(a) = args.next() {
        match a.as_str() { "-m" => o.masks = args.next().map(Into::into), "-r" => o.max_resolution = args.next().map(|v| v.parse().unwrap()), "-n" => o.photos = false, "-d" => dump = args.next(), _ => panic!() }
    }
    let t = Instant::now();
    if scene.ends_with(".ply") {
        let r = io::ply::read_gaussians(&scene).unwrap();
        println!("{} gaussians degree {} labels {:?} dropped {} {:?} {:?}", r.gaussians.len(), r.gaussians.sh_degree, r.gaussians.labels.as_ref().map(|l| l.len()), r.dropped, r.notes, t.elapsed());
        let n = io::ply::write_gaussians("/tmp/io_try.ply", &r.gaussians).unwrap();
        let again = io::ply::read_gaussians("/tmp/io_try.ply").unwrap();
        assert_eq!(again.gaussians, r.gaussians); println!("left out {n}, same");
        return;
    }
    match io::open(std::path::Path::new(&scene), &o) {
        Err(e) => println!("ERR {} {e}", e.exit_status()),
        Ok(d) => {
            println!("{} train {} test {} points, extent {:.3} {:?}", d.train.len(), d.test.len(), d.points.len(), d.extent(), t.elapsed());
            d.notes.iter().for_each(|n| println!("note: {n}"));
            let v = &d.train[0];
            println!("{} {:?} objects {:?}", v.name, v.camera, v.mask.as_ref().map(|m| m.objects()));
            let t = Instant::now();
            let g = io::initial_gaussians(&d, 1, 50_000).unwrap();
            println!("init {} {:?}", g.len(), t.elapsed());
            if let Some(dir) = dump {
                io::ply::write_gaussians(format!("{dir}/init.ply"), &g).unwrap();
                for v in d.train.iter().take(3) {
                    let p = v.photo.as_ref().unwrap();
                    let mut img: Vec<[u8;3]> = p.rgba.iter().map(|t| [t[0],t[1],t[2]]).collect();
                    io::image::write_png_rgb8(format!("{dir}/{}_photo.png", v.stem()), p.width, p.height, &img).unwrap();
                    let mut order: Vec<usize> = (0..g.len()).collect();
                    order.sort_by(|&a,&b| { let z = |i: usize| v.camera.to_camera(glam::Vec3::from_array(g.means[i]).as_dvec3()).z; z(b).total_cmp(&z(a)) });
                    img.iter_mut().for_each(|p| *p=[0;3]);
                    for i in order { let c = v.camera.to_camera(glam::Vec3::from_array(g.means[i]).as_dvec3()); if c.z<=0.0 {continue} let px = v.camera.project(c); if px.x>=0.0&&px.y>=0.0&&px.x<p.width as f64&&px.y<p.height as f64 { let k=(px.y as usize)*p.width as usize+px.x as usize; img[k]=g.sh0[i].map(|s| ((s*0.28209+0.5)*255.0) as u8); } }
                    io::image::write_png_rgb8(format!("{dir}/{}_init.png", v.stem()), p.width, p.height, &img).unwrap();
                    if let Some(m) = &v.mask { let c: Vec<[u8;3]> = m.ids.iter().map(|&i| labelgs::scene::labels::label_colour(i as u32)).collect(); io::image::write_png_rgb8(format!("{dir}/{}_mask.png", v.stem()), p.width, p.height, &c).unwrap(); }
                }
            }
        }
    }
}
